//! Where to sample: uniformly over the valid directions, as pictures see them, along a low-discrepancy
//! sequence, or by the importance of the mean BRDF.

mod mean_brdf;
mod range;

pub use mean_brdf::MeanBrdf;
pub use range::RANGE;

use std::f32::consts::TAU;

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::angles_of;

/// `count` angles, uniform in (theta_h, theta_d, phi_d) over the valid region, by rejection;
/// phi_d in \[0, 2 pi).
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

/// `count` angles as pictures of a sphere see them: any of its points, seen from far away, and light from
/// any part of the sky above; phi_d in \[0, 2 pi).
#[must_use]
pub fn sphere_view_samples(count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut angles = Vec::with_capacity(count);
    while angles.len() < count {
        // A disc is seen: sin^2(theta_o) is uniform. So is the cosine of a light in the sky.
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

/// The first `count` valid points of the three-dimensional Sobol sequence (Owen-scrambled by
/// `seed`), scaled to the range of a pattern: phi_d in \[0, pi).
#[must_use]
pub fn sobol_valid(count: usize, seed: u32) -> Vec<Angles<f32>> {
    let [theta_h, theta_d, phi_d] = RANGE;
    (0..1 << 16)
        .map(|index| Angles {
            theta_h: theta_h * sobol_burley::sample(index, 0, seed),
            theta_d: theta_d * sobol_burley::sample(index, 1, seed),
            phi_d: phi_d * sobol_burley::sample(index, 2, seed),
        })
        .filter(|angles| HalfDifference::from_angles(*angles).is_valid())
        .take(count)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_sphere_half_of_its_disc_is_seen_within_45_degrees() {
        let angles = sphere_view_samples(20_000, 7);
        let share = |of: &dyn Fn(&HalfDifference<f32>) -> bool| {
            let places = angles.iter().copied().map(HalfDifference::from_angles);
            places.filter(of).count() as f32 / angles.len() as f32
        };
        let near = share(&|at| at.cos_theta_o() > 0.5_f32.sqrt());
        // A quarter of the sky is as high as that.
        let high = share(&|at| at.cos_theta_i() > 0.75);
        assert!((near - 0.5).abs() < 0.02, "{near}");
        assert!((high - 0.25).abs() < 0.02, "{high}");
        assert!(
            angles
                .iter()
                .all(|at| HalfDifference::from_angles(*at).is_valid())
        );
    }
}
