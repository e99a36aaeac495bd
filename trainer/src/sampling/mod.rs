//! Where to sample: uniformly over the valid directions, along a low-discrepancy sequence, or by
//! the importance of the mean BRDF.

mod mean_brdf;
mod range;

pub use mean_brdf::MeanBrdf;
pub use range::RANGE;

use glimpse_core::geometry::{Angles, HalfDifference};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
