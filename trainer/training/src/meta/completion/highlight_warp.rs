//! Highlight warps: augmented materials with wider or narrower highlights.

use std::f32::consts::FRAC_PI_2;

use glimpse_core::geometry::Angles;

/// A warp of theta_h. The warped BRDF at theta_h is that of the material at the angle whose tangent is `stretch` times
/// as large. A stretch above 1 narrows the highlight by that factor.
///
/// If that angle has a direction below the horizon, the largest valid angle is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighlightWarp {
    /// The factor on the tangent of theta_h.
    pub stretch: f32,
}

/// The largest valid tangent, as a share of the tangent at the horizon.
const MAX_TANGENT_RATIO: f32 = 0.999;

impl HighlightWarp {
    /// The identity.
    pub const IDENTITY: Self = Self { stretch: 1.0 };

    /// Returns the angles at which the unwarped material is evaluated, and the derivatives of that theta_h by the given
    /// theta_h, theta_d and phi_d.
    #[must_use]
    pub fn angles(self, angles: Angles<f32>) -> (Angles<f32>, [f32; 3]) {
        const UNIT_SLOPES: [f32; 3] = [1.0, 0.0, 0.0];
        if self == Self::IDENTITY {
            return (angles, UNIT_SLOPES);
        }
        let tangent = angles.theta_h.min(FRAC_PI_2 - 1e-4).tan();
        let stretched = self.stretch * tangent;
        // At the horizon 1 = tan(theta_h) tan(theta_d) |cos(phi_d)|.
        let across = (angles.theta_d.tan().abs() * angles.phi_d.cos().abs()).max(1e-6);
        let horizon = MAX_TANGENT_RATIO / across;
        let (warped, slopes) = if stretched <= tangent.max(horizon) {
            let by_theta_h = self.stretch * (1.0 + tangent * tangent);
            (stretched, [by_theta_h, 0.0, 0.0])
        } else if horizon > tangent {
            let sin_cos = angles.theta_d.sin() * angles.theta_d.cos();
            let by_theta_d = -horizon / sin_cos.max(1e-6);
            (horizon, [0.0, by_theta_d, horizon * angles.phi_d.tan()])
        } else {
            return (angles, UNIT_SLOPES);
        };
        let slopes = slopes.map(|slope| slope / (1.0 + warped * warped));
        let theta_h = warped.atan();
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
    fn warped_angles_are_valid_with_correct_derivatives() {
        const STEP: f32 = 1e-3;
        let mut compared = [0; 2];
        for stretch in [0.67, 1.5] {
            let highlight_warp = HighlightWarp { stretch };
            for angles in uniform_valid(3_000, 4) {
                let (warped, slopes) = highlight_warp.angles(angles);
                assert!(HalfDifference::from_angles(warped).is_valid(), "{angles:?}");
                for (angle, slope) in slopes.into_iter().enumerate() {
                    let [low, high] =
                        [-STEP, STEP].map(|by| highlight_warp.angles(moved(angles, angle, by)));
                    let difference = (high.0.theta_h - low.0.theta_h) / (2.0 * STEP);
                    // Excludes the horizon, and steep tangents.
                    let smooth = (high.1[angle] - low.1[angle]).abs() < 0.05 + 0.05 * slope.abs();
                    let is_regular = angles.theta_d > 0.05 && (angles.phi_d.cos()).abs() > 0.05;
                    if smooth && is_regular && low.0.theta_d > 0.0 {
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
    fn warp_scales_tangent_of_theta_h() {
        let angles = Angles {
            theta_h: 0.1,
            theta_d: 0.5,
            phi_d: 1.0,
        };
        let (warped, _) = HighlightWarp { stretch: 1.5 }.angles(angles);
        assert!((warped.theta_h.tan() - 1.5 * 0.1_f32.tan()).abs() < 1e-6);
        assert_eq!(
            HighlightWarp::IDENTITY.angles(angles),
            (angles, [1.0, 0.0, 0.0])
        );
    }
}
