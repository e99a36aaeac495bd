//! Highlights that are wider or narrower than a material's.

use std::f32::consts::FRAC_PI_2;

use glimpse_core::geometry::Angles;

/// A material whose BRDF at theta_h is another one's at the angle whose tangent is `stretch` times as
/// large: its highlight is narrower by that factor, if that is above 1, or wider.
///
/// Where the other one's direction would be below the horizon, it is the last one above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighlightWarp {
    /// What the tangent of theta_h is multiplied by.
    pub stretch: f32,
}

/// How near to the horizon, as a share of the tangent there.
const NEAREST: f32 = 0.999;

impl HighlightWarp {
    /// The highlight as it is.
    pub const NONE: Self = Self { stretch: 1.0 };

    /// Where the other material is looked up, and the derivatives of its theta_h by theta_h, theta_d and
    /// phi_d as given.
    #[must_use]
    pub fn angles(self, angles: Angles<f32>) -> (Angles<f32>, [f32; 3]) {
        const SAME: [f32; 3] = [1.0, 0.0, 0.0];
        if self == Self::NONE {
            return (angles, SAME);
        }
        let tangent = angles.theta_h.min(FRAC_PI_2 - 1e-4).tan();
        let stretched = self.stretch * tangent;
        // At the horizon 1 = tan(theta_h) tan(theta_d) |cos(phi_d)|.
        let across = (angles.theta_d.tan().abs() * angles.phi_d.cos().abs()).max(1e-6);
        let horizon = NEAREST / across;
        let (found, slopes) = if stretched <= tangent.max(horizon) {
            let by_theta_h = self.stretch * (1.0 + tangent * tangent);
            (stretched, [by_theta_h, 0.0, 0.0])
        } else if horizon > tangent {
            let sin_cos = angles.theta_d.sin() * angles.theta_d.cos();
            let by_theta_d = -horizon / sin_cos.max(1e-6);
            (horizon, [0.0, by_theta_d, horizon * angles.phi_d.tan()])
        } else {
            return (angles, SAME);
        };
        let slopes = slopes.map(|slope| slope / (1.0 + found * found));
        let theta_h = found.atan();
        (Angles { theta_h, ..angles }, slopes)
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::HalfDifference;

    use super::*;
    use glimpse_materials::sampling::uniform_valid;

    fn moved(angles: Angles<f32>, angle: usize, by: f32) -> Angles<f32> {
        let mut moved = angles;
        *[&mut moved.theta_h, &mut moved.theta_d, &mut moved.phi_d][angle] += by;
        moved
    }

    #[test]
    fn a_warped_direction_is_above_the_horizon_and_its_derivatives_are_those_of_differences() {
        const STEP: f32 = 1e-3;
        let mut compared = [0; 2];
        for stretch in [0.67, 1.5] {
            let highlight_warp = HighlightWarp { stretch };
            for angles in uniform_valid(3_000, 4) {
                let (found, slopes) = highlight_warp.angles(angles);
                assert!(HalfDifference::from_angles(found).is_valid(), "{angles:?}");
                for (angle, slope) in slopes.into_iter().enumerate() {
                    let [low, high] =
                        [-STEP, STEP].map(|by| highlight_warp.angles(moved(angles, angle, by)));
                    let difference = (high.0.theta_h - low.0.theta_h) / (2.0 * STEP);
                    // Not where the horizon comes between, nor where a tangent runs away.
                    let smooth = (high.1[angle] - low.1[angle]).abs() < 0.05 + 0.05 * slope.abs();
                    let apart = angles.theta_d > 0.05 && (angles.phi_d.cos()).abs() > 0.05;
                    if smooth && apart && low.0.theta_d > 0.0 {
                        let error = (difference - slope).abs();
                        assert!(
                            error < 0.01 + 0.02 * slope.abs(),
                            "{angles:?}: {difference} {slope}"
                        );
                        compared[usize::from(slopes[1] != 0.0)] += 1;
                    }
                }
            }
        }
        assert!(compared[0] > 5_000 && compared[1] > 300, "{compared:?}");
    }

    #[test]
    fn a_highlight_is_narrower_by_the_factor() {
        let angles = Angles {
            theta_h: 0.1,
            theta_d: 0.5,
            phi_d: 1.0,
        };
        let (found, _) = HighlightWarp { stretch: 1.5 }.angles(angles);
        assert!((found.theta_h.tan() - 1.5 * 0.1_f32.tan()).abs() < 1e-6);
        assert_eq!(
            HighlightWarp::NONE.angles(angles),
            (angles, [1.0, 0.0, 0.0])
        );
    }
}
