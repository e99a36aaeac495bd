//! Overflow of single precision in training.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use glimpse_kernels::lanes::{InstructionSet, Octet, WIDTH};
use glimpse_kernels::samples::SampleOctets;
use glimpse_kernels::{Dual, ModelKernels};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::forward::flat;

/// Returns the loss, its gradient, a Hessian-vector product, and the product's derivatives with respect to the samples.
fn gradient_and_product(
    kernels: &ModelKernels,
    theta: &[Dual<f32>; 8],
    samples: &SampleOctets<'_>,
) -> Vec<f32> {
    let [mut gradient, mut product] = [[0.0; 8]; 2];
    let loss = (kernels.gradient)(&theta.map(|dual| dual.value), samples, &mut gradient);
    let mut derivatives = samples.zero_derivatives();
    (kernels.product)(theta, samples, &mut product, Some(&mut derivatives));
    let derivatives = derivatives.iter().flat_map(flat).flat_map(|octet| octet.0);
    let lists = gradient.into_iter().chain(product);
    lists.chain(derivatives).chain([loss]).collect()
}

/// Returns a random angle whose distance from 0 or pi/2 may be as small as 1e-8 pi/2.
fn angle(random: &mut ChaCha8Rng) -> f32 {
    let distance = std::f32::consts::FRAC_PI_2 * 10.0_f32.powf(random.random_range(-8.0..0.0));
    if random.random() {
        distance
    } else {
        std::f32::consts::FRAC_PI_2 - distance
    }
}

#[test]
fn cook_torrance_is_finite_at_extremes() {
    let kernels = ModelKernels::of(ModelKind::CookTorrance).expect("the model has parameters");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut valid = 0;
    for _ in 0..20_000 {
        let theta: [Dual<f32>; 8] = std::array::from_fn(|_| Dual {
            value: random.random_range(-12.0..12.0),
            tangent: [random.random_range(-10.0..10.0)],
        });
        let at: [HalfDifference<f32>; WIDTH] = std::array::from_fn(|_| {
            let [theta_h, theta_d] = [(); 2].map(|()| angle(&mut random));
            let phi_d = random.random_range(0.0..std::f32::consts::TAU);
            HalfDifference::from_angles(Angles::from_array([theta_h, theta_d, phi_d]))
        });
        // Samples below the horizon are also computed, with weight 0.
        let weights = Octet(at.map(|at| f32::from(u8::from(at.is_valid()))));
        valid += at.iter().filter(|at| at.is_valid()).count();
        let measured = [0; 3].map(|_| Octet([random.random_range(-12.0..12.0f32).exp(); WIDTH]));
        let best = InstructionSet::detect();
        for instruction_set in [best, InstructionSet::Portable] {
            let outputs = gradient_and_product(
                kernels,
                &theta,
                &SampleOctets {
                    at: &[Octet::transpose(&at)],
                    values: &[measured],
                    weights: &[weights],
                    instruction_set,
                },
            );
            assert!(
                outputs.iter().all(|value| value.is_finite()),
                "{outputs:?} at {at:?} for {theta:?}"
            );
        }
    }
    assert!(valid > 40_000, "only {valid} samples are valid");
}
