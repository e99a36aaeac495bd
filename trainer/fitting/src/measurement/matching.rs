//! Matching of a pair of directions to the nearest sample of a pattern.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

use glimpse_core::geometry::{Angles, HalfDifference};

/// The angles of light and sensor on which an isotropic BRDF depends, in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsotropicAngles {
    /// The light's angle from the normal.
    pub theta_i: f64,
    /// The sensor's angle from the normal.
    pub theta_o: f64,
    /// The sensor's azimuth minus the light's, phi_o - phi_i.
    pub phi: f64,
}

/// The distance between two pairs of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngularDistance {
    /// The largest difference of the three angles, in radians.
    pub radians: f64,
    /// The angle that differs most.
    pub angle: &'static str,
}

impl fmt::Display for AngularDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.2} degrees off in {}",
            self.radians.to_degrees(),
            self.angle
        )
    }
}

impl IsotropicAngles {
    /// Converts Rusinkiewicz angles, in radians.
    #[must_use]
    pub fn from_angles(angles: Angles<f64>) -> Self {
        let pair = HalfDifference::from_angles(angles).directions();
        let theta = |[x, y, z]: [f64; 3]| x.hypot(y).atan2(z);
        let phi = |[x, y, _]: [f64; 3]| y.atan2(x);
        Self {
            theta_i: theta(pair.incoming),
            theta_o: theta(pair.outgoing),
            phi: phi(pair.outgoing) - phi(pair.incoming),
        }
    }

    /// Returns the distance to another pair: the largest of three differences. These are the differences of theta_i, of
    /// theta_o, and of phi times the smallest sine of the polar angles. The sine is small near the normal, where
    /// azimuths matter little.
    #[must_use]
    pub fn distance(&self, other: &Self) -> AngularDistance {
        let azimuth_difference = (self.phi - other.phi + PI).rem_euclid(TAU) - PI;
        let sines = [self, other].map(|angles| angles.theta_i.sin().min(angles.theta_o.sin()));
        let differences = [
            ("theta_i", (self.theta_i - other.theta_i).abs()),
            ("theta_o", (self.theta_o - other.theta_o).abs()),
            (
                "phi_o - phi_i, scaled by the smallest sine of a polar angle",
                azimuth_difference.abs() * sines[0].min(sines[1]),
            ),
        ];
        let mut distance = AngularDistance {
            radians: 0.0,
            angle: differences[0].0,
        };
        for (angle, radians) in differences {
            // NaN counts as the largest distance.
            if radians > distance.radians || radians.is_nan() {
                distance = AngularDistance { radians, angle };
            }
        }
        distance
    }

    /// Exchanges light and sensor. The BRDF of a reciprocal material stays the same.
    #[must_use]
    pub fn exchanged(&self) -> Self {
        Self {
            theta_i: self.theta_o,
            theta_o: self.theta_i,
            phi: -self.phi,
        }
    }

    /// Returns the angles if the polar angles were measured from the surface.
    #[must_use]
    pub fn from_surface(&self) -> Self {
        Self {
            theta_i: FRAC_PI_2 - self.theta_i,
            theta_o: FRAC_PI_2 - self.theta_o,
            ..*self
        }
    }

    /// Returns the angles with the sensor at the opposite azimuth.
    #[must_use]
    pub fn opposite(&self) -> Self {
        Self {
            phi: self.phi + PI,
            ..*self
        }
    }

    /// Reverses the sense of the azimuths. In the plane of incidence, where phi is 0 or 180 degrees, the directions
    /// stay the same. Elsewhere they change, but a mirror-symmetric material has the same BRDF.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            phi: -self.phi,
            ..*self
        }
    }

    /// Returns the index of the nearest sample of a pattern and its distance; None if the pattern is empty.
    #[must_use]
    pub fn nearest(&self, pattern: &[Self]) -> Option<(usize, AngularDistance)> {
        let distances = pattern.iter().map(|sample| self.distance(sample));
        distances
            .enumerate()
            .min_by(|(_, a), (_, b)| a.radians.total_cmp(&b.radians))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(theta_i: f64, theta_o: f64, phi: f64) -> IsotropicAngles {
        IsotropicAngles {
            theta_i: theta_i.to_radians(),
            theta_o: theta_o.to_radians(),
            phi: phi.to_radians(),
        }
    }

    #[test]
    fn distance_weights_azimuth_by_smallest_sine() {
        let from = degrees(30.0, 60.0, 179.0);
        let distance_in_degrees = |to: IsotropicAngles| {
            let AngularDistance { radians, angle } = from.distance(&to);
            (
                (radians.to_degrees() * 1e6).round() / 1e6,
                angle.split(',').next(),
            )
        };
        assert_eq!(
            distance_in_degrees(degrees(30.2, 60.1, 179.0)),
            (0.2, Some("theta_i"))
        );
        assert_eq!(
            distance_in_degrees(degrees(30.1, 59.6, 179.0)),
            (0.4, Some("theta_o"))
        );
        // The azimuths differ by 2 degrees, across 180; times sin(30 degrees).
        let azimuths = Some("phi_o - phi_i");
        assert_eq!(
            distance_in_degrees(degrees(30.0, 60.0, -179.0)),
            (1.0, azimuths)
        );
        assert_eq!(
            distance_in_degrees(degrees(30.0, 60.0, 179.0 + 720.0)).0,
            0.0
        );
        let exchanged = degrees(60.0, 30.0, -179.0).exchanged();
        assert_eq!(from.distance(&exchanged).radians, 0.0);
        // Mirroring changes the angles, except in the plane of incidence.
        assert_eq!(
            from.distance(&from.mirrored()).radians.to_degrees().round(),
            1.0
        );
        assert_eq!(
            degrees(30.0, 60.0, 180.0)
                .mirrored()
                .distance(&degrees(30.0, 60.0, 180.0))
                .radians,
            0.0
        );
        // At the normal the azimuth does not matter.
        assert!(
            degrees(0.0, 60.0, 0.0)
                .distance(&degrees(0.0, 60.0, 90.0))
                .radians
                < 1e-12
        );
    }
}
