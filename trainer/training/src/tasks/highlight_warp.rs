//! Highlight warps: augmented materials with wider or narrower highlights.

use std::f32::consts::FRAC_PI_2;

use glimpse_core::geometry::Angles;

/// A warp of theta_h: the warped BRDF at theta_h is the BRDF of the material at atan(`stretch` tan(theta_h)). A stretch
/// above 1 narrows the highlight by that factor.
///
/// If the light or sensor is below the horizon at that angle, the largest valid angle replaces it.
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

    /// Returns the warps of training: the identity, then highlights of 0.67 to 1.5 times the width.
    #[must_use]
    pub fn all() -> [Self; 7] {
        [0.0_f32, -1.0, -0.67, -0.33, 0.33, 0.67, 1.0].map(|exponent| Self {
            stretch: (0.4 * exponent).exp(),
        })
    }

    /// Returns the angles at which the unwarped material is evaluated. Also returns the derivatives of their theta_h
    /// with respect to theta_h, theta_d and phi_d of `angles`.
    #[must_use]
    pub fn angles(self, angles: Angles<f32>) -> (Angles<f32>, [f32; 3]) {
        const UNIT_SLOPES: [f32; 3] = [1.0, 0.0, 0.0];
        if self == Self::IDENTITY {
            return (angles, UNIT_SLOPES);
        }
        let tangent = angles.theta_h.min(FRAC_PI_2 - 1e-4).tan();
        let stretched = self.stretch * tangent;
        // At the horizon, tan(theta_h) tan(theta_d) |cos(phi_d)| = 1.
        let across = (angles.theta_d.tan().abs() * angles.phi_d.cos().abs()).max(1e-6);
        let max_tangent = MAX_TANGENT_RATIO / across;
        let (warped_tangent, slopes) = if stretched <= tangent.max(max_tangent) {
            let by_theta_h = self.stretch * (1.0 + tangent * tangent);
            (stretched, [by_theta_h, 0.0, 0.0])
        } else if max_tangent > tangent {
            let sin_cos = angles.theta_d.sin() * angles.theta_d.cos();
            let by_theta_d = -max_tangent / sin_cos.max(1e-6);
            let by_phi_d = max_tangent * angles.phi_d.tan();
            (max_tangent, [0.0, by_theta_d, by_phi_d])
        } else {
            // The original tangent is already at or above the largest valid one.
            return (angles, UNIT_SLOPES);
        };
        let slopes = slopes.map(|slope| slope / (1.0 + warped_tangent * warped_tangent));
        let theta_h = warped_tangent.atan();
        (Angles { theta_h, ..angles }, slopes)
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::HalfDifference;

    use super::*;
    use glimpse_materials::sampling::uniform_valid;

    fn displaced(angles: Angles<f32>, axis: usize, offset: f32) -> Angles<f32> {
        let mut displaced = angles;
        *[
            &mut displaced.theta_h,
            &mut displaced.theta_d,
            &mut displaced.phi_d,
        ][axis] += offset;
        displaced
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
                for (axis, slope) in slopes.into_iter().enumerate() {
                    let [low, high] = [-STEP, STEP]
                        .map(|offset| highlight_warp.angles(displaced(angles, axis, offset)));
                    let difference = (high.0.theta_h - low.0.theta_h) / (2.0 * STEP);
                    // Skip the horizon, and steep tangents.
                    let is_smooth = (high.1[axis] - low.1[axis]).abs() < 0.05 + 0.05 * slope.abs();
                    let is_regular = angles.theta_d > 0.05 && (angles.phi_d.cos()).abs() > 0.05;
                    if is_smooth && is_regular && low.0.theta_d > 0.0 {
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
        let angles = Angles::from_array([0.1, 0.5, 1.0]);
        let (warped, _) = HighlightWarp { stretch: 1.5 }.angles(angles);
        assert!((warped.theta_h.tan() - 1.5 * 0.1_f32.tan()).abs() < 1e-6);
        assert_eq!(
            HighlightWarp::IDENTITY.angles(angles),
            (angles, [1.0, 0.0, 0.0])
        );
    }
}
