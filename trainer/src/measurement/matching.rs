//! To which sample of a pattern a pair of directions belongs.

use std::f64::consts::{PI, TAU};
use std::fmt;

use glimpse_core::geometry::{Angles, HalfDifference};

/// Where light and sensor are, as far as an isotropic material can tell; radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arms {
    /// The light's angle to the normal.
    pub theta_i: f64,
    /// The sensor's angle to the normal.
    pub theta_o: f64,
    /// The sensor's azimuth from the light's on.
    pub phi: f64,
}

/// How far two pairs of directions are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// The largest of the three angles, radians.
    pub largest: f64,
    /// Which one it is.
    pub of: &'static str,
}

impl fmt::Display for Distance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.2} degrees off in {}",
            self.largest.to_degrees(),
            self.of
        )
    }
}

impl Arms {
    /// Of Rusinkiewicz angles, radians.
    #[must_use]
    pub fn of(angles: Angles<f64>) -> Self {
        let pair = HalfDifference::from_angles(angles).directions();
        let theta = |[x, y, z]: [f64; 3]| x.hypot(y).atan2(z);
        let phi = |[x, y, _]: [f64; 3]| y.atan2(x);
        Self {
            theta_i: theta(pair.incoming),
            theta_o: theta(pair.outgoing),
            phi: phi(pair.outgoing) - phi(pair.incoming),
        }
    }

    /// The largest of what theta_i and theta_o differ by, and of what the azimuths do times the
    /// smaller sine: the turn that a direction near the normal makes is a small one.
    #[must_use]
    pub fn distance(&self, other: &Self) -> Distance {
        let turn = (self.phi - other.phi + PI).rem_euclid(TAU) - PI;
        let sines = [self, other].map(|arms| arms.theta_i.sin().min(arms.theta_o.sin()));
        let parts = [
            ("theta_i", (self.theta_i - other.theta_i).abs()),
            ("theta_o", (self.theta_o - other.theta_o).abs()),
            (
                "the difference of azimuths, phi_o - phi_i, times the smaller sine",
                turn.abs() * sines[0].min(sines[1]),
            ),
        ];
        let mut found = Distance {
            largest: 0.0,
            of: parts[0].0,
        };
        for (of, part) in parts {
            // What is no number is far away.
            if part > found.largest || part.is_nan() {
                found = Distance { largest: part, of };
            }
        }
        found
    }

    /// Light and sensor exchanged: to a reciprocal material the same.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        Self {
            theta_i: self.theta_o,
            theta_o: self.theta_i,
            phi: -self.phi,
        }
    }

    /// The azimuth counted the other way round. It changes nothing in the plane of incidence, where phi is 0 or
    /// 180 degrees. Elsewhere it is another pair of directions, though of a material that is its own mirror image
    /// the BRDF is the same.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            phi: -self.phi,
            ..*self
        }
    }

    /// The nearest sample of a pattern, and how far it is; None of an empty one.
    #[must_use]
    pub fn nearest(&self, pattern: &[Self]) -> Option<(usize, Distance)> {
        let all = pattern.iter().map(|arms| self.distance(arms)).enumerate();
        all.min_by(|(_, a), (_, b)| a.largest.total_cmp(&b.largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arms(theta_i: f64, theta_o: f64, phi: f64) -> Arms {
        Arms {
            theta_i: theta_i.to_radians(),
            theta_o: theta_o.to_radians(),
            phi: phi.to_radians(),
        }
    }

    #[test]
    fn the_largest_angle_counts_and_azimuths_by_the_smaller_sine() {
        let from = arms(30.0, 60.0, 179.0);
        let far = |to: Arms| {
            let Distance { largest, of } = from.distance(&to);
            (
                (largest.to_degrees() * 1e6).round() / 1e6,
                of.split(',').next(),
            )
        };
        assert_eq!(far(arms(30.2, 60.1, 179.0)), (0.2, Some("theta_i")));
        assert_eq!(far(arms(30.1, 59.6, 179.0)), (0.4, Some("theta_o")));
        // Once round, and times sin(30 degrees).
        let azimuths = Some("the difference of azimuths");
        assert_eq!(far(arms(30.0, 60.0, -179.0)), (1.0, azimuths));
        assert_eq!(far(arms(30.0, 60.0, 179.0 + 720.0)).0, 0.0);
        // The other way round it is the same to a reciprocal material only.
        let there_and_back = arms(60.0, 30.0, -179.0).exchanged();
        assert_eq!(from.distance(&there_and_back).largest, 0.0);
        // An azimuth that is counted the other way round is another one, but in the plane of incidence.
        assert_eq!(
            from.distance(&from.mirrored()).largest.to_degrees().round(),
            1.0
        );
        assert_eq!(
            arms(30.0, 60.0, 180.0)
                .mirrored()
                .distance(&arms(30.0, 60.0, 180.0))
                .largest,
            0.0
        );
        // At the normal there is no azimuth.
        assert!(
            arms(0.0, 60.0, 0.0)
                .distance(&arms(0.0, 60.0, 90.0))
                .largest
                < 1e-12
        );
    }

    #[test]
    fn rusinkiewicz_angles_become_arms() {
        let angles = Angles {
            theta_h: 0.0,
            theta_d: 0.6,
            phi_d: 1.0,
        };
        let mirror = Arms::of(angles);
        let expected = Arms {
            theta_i: 0.6,
            theta_o: 0.6,
            phi: PI,
        };
        assert!(mirror.distance(&expected).largest < 1e-12, "{mirror:?}");
        let others = [expected, arms(1.0, 1.0, 0.0)];
        assert_eq!(mirror.nearest(&others).unwrap().0, 0);
        assert!(mirror.nearest(&[]).is_none());
    }
}
