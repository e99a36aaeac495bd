//! Sampling of directions: uniform, as seen on a sphere, or by a Sobol sequence.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::angles_of;

/// Upper limits of theta_h, theta_d and phi_d, radians. The lower limits are 0.
pub const RANGE: [f32; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
/// The length of a sequence of `sobol_burley`.
const SOBOL_POINTS: u32 = 1 << 16;

/// Returns `count` angles that are uniform in (theta_h, theta_d, phi_d) over the valid region, by rejection. phi_d is
/// in \[0, 2 pi).
#[must_use]
pub fn uniform_valid(count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let [theta_h, theta_d, phi_d] = RANGE;
    let mut angles = Vec::with_capacity(count);
    while angles.len() < count {
        let candidate = Angles {
            theta_h: theta_h * random.random::<f32>(),
            theta_d: theta_d * random.random::<f32>(),
            phi_d: 2.0 * phi_d * random.random::<f32>(),
        };
        if HalfDifference::from_angles(candidate).is_valid() {
            angles.push(candidate);
        }
    }
    angles
}

/// Returns `count` angles with the distribution of an orthographic image of a sphere under a uniform sky. phi_d is in
/// \[0, 2 pi).
#[must_use]
pub fn sphere_view_samples(count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut angles = Vec::with_capacity(count);
    while angles.len() < count {
        // The image of the sphere is a disc, so that sin^2(theta_o) is uniform. Under a uniform sky, cos(theta_i) is
        // uniform.
        let [sin_squared, cos_theta_i, turn]: [f32; 3] = random.random();
        let (sin_phi, cos_phi) = (TAU * turn).sin_cos();
        let sin_theta_i = (1.0 - cos_theta_i * cos_theta_i).sqrt();
        let directions = Directions {
            incoming: [sin_theta_i * cos_phi, sin_theta_i * sin_phi, cos_theta_i],
            outgoing: [sin_squared.sqrt(), 0.0, (1.0 - sin_squared).sqrt()],
        };
        let at = HalfDifference::from_directions(&directions);
        angles.extend(at.filter(HalfDifference::is_valid).as_ref().map(angles_of));
    }
    angles
}

/// Returns the first `count` valid points of the three-dimensional Sobol sequence, Owen-scrambled with `seed` and
/// scaled to [`RANGE`]. phi_d is in \[0, pi). Returns fewer points if 65,536 candidates do not suffice.
#[must_use]
pub fn sobol_valid(count: usize, seed: u32) -> Vec<Angles<f32>> {
    (0..SOBOL_POINTS)
        .map(|index| {
            let point = [0, 1, 2].map(|axis| sobol_burley::sample(index, axis, seed));
            Angles::from_array([0, 1, 2].map(|axis| RANGE[axis] * point[axis]))
        })
        .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
        .take(count)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sphere_views_follow_disc_and_sky() {
        let angles = sphere_view_samples(20_000, 7);
        let fraction = |condition: &dyn Fn(&HalfDifference<f32>) -> bool| {
            let directions = angles.iter().copied().map(HalfDifference::from_angles);
            directions.filter(condition).count() as f32 / angles.len() as f32
        };
        // theta_o is below 45 degrees on half of the disc, and cos(theta_i) is above 0.75 on a quarter of the sky.
        let within_45 = fraction(&|at| at.cos_theta_o() > 0.5_f32.sqrt());
        let near_zenith = fraction(&|at| at.cos_theta_i() > 0.75);
        assert!((within_45 - 0.5).abs() < 0.02, "{within_45}");
        assert!((near_zenith - 0.25).abs() < 0.02, "{near_zenith}");
        assert!(
            angles
                .iter()
                .all(|at| HalfDifference::from_angles(*at).is_valid())
        );
    }
}
