//! Tests of patterns: logits, measurements, and the gradient with respect to the logits.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::SampleGradient;
use glimpse_kernels::lanes::{Octet, WIDTH};
use glimpse_materials::sampling::sobol_valid;
use glimpse_training::pattern::{Reach, SamplePattern};
use glimpse_training::tasks::samples::WeightedSamples;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::lanes::unpack;
use crate::support::to_f64;

/// The factor of the barrier: BARRIER (theta_h^2 + theta_d^2) for each sample below the horizon.
const BARRIER: f64 = 0.005;

/// Returns the angles of a sample's logits.
fn angles(logits: [f64; 3]) -> [f64; 3] {
    let ranges = [FRAC_PI_2, FRAC_PI_2, PI];
    std::array::from_fn(|i| ranges[i] / (1.0 + (-logits[i]).exp()))
}

fn half_difference(logits: [f64; 3]) -> HalfDifference<f64> {
    HalfDifference::from_angles(Angles::from_array(angles(logits)))
}

fn is_valid(logits: [f64; 3]) -> bool {
    let at = half_difference(logits);
    at.cos_theta_i() > 0.0 && at.cos_theta_o() > 0.0
}

/// Returns a source of random numbers, and the pattern of an octet of samples with its logits. One sample is below the
/// horizon.
fn pattern_with_one_below_horizon(seed: u64) -> (ChaCha8Rng, Vec<[f32; 3]>, SamplePattern) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let valid_samples = sobol_valid(WIDTH - 1, random.random()).into_iter();
    let mut logits: Vec<_> = valid_samples.map(|at| Reach::ANY.logits(at)).collect();
    let below_horizon = [
        random.random_range(1.5..2.5),
        random.random_range(1.5..2.5),
        -2.5,
    ];
    logits.insert(random.random_range(0..WIDTH), below_horizon);
    let pattern = Reach::ANY.pattern(logits.as_flattened());
    (random, logits, pattern)
}

/// Samples below the horizon are excluded.
#[test]
fn present_samples_have_equal_weights() {
    let (mut random, logits, pattern) = pattern_with_one_below_horizon(3);
    let brdf: Vec<[f32; 3]> = (0..8).map(|_| random.random()).collect();
    let samples = WeightedSamples::present(&pattern.octet_directions, &brdf, &pattern.valid);
    let samples = unpack(&samples.octets());

    let all = logits.iter().map(|each| each.map(f64::from)).zip(brdf);
    let valid: Vec<_> = all.filter(|(logits, _)| is_valid(*logits)).collect();
    assert_eq!((samples.len(), valid.len()), (7, 7));
    for (sample, (logits, brdf)) in samples.iter().zip(valid) {
        let expected = half_difference(logits).to_array();
        for (actual, expected) in sample.at.to_array().into_iter().zip(expected) {
            assert!((actual - expected).abs() < 1e-6, "{sample:?}");
        }
        assert_eq!(sample.measured, brdf.map(f64::from));
        assert!((sample.weight - 1.0 / 21.0).abs() < 1e-8);
    }
}

fn random_gradient(random: &mut ChaCha8Rng) -> SampleGradient<Octet> {
    let mut octet = || Octet(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
    SampleGradient {
        at: HalfDifference::from_array([(); 5].map(|()| octet())),
        measured: [(); 3].map(|()| octet()),
    }
}

#[test]
fn invalid_sample_has_the_gradient_of_the_barrier() {
    let (mut random, logits, pattern) = pattern_with_one_below_horizon(1);
    // The gradient with respect to the samples must not matter.
    let by_sample = [random_gradient(&mut random)];
    let by_logits =
        to_f64(&pattern.gradient_by_logits(|index| pattern.gradient_by_angles(&by_sample, index)));
    let mut samples = logits.iter().map(|each| each.map(f64::from));
    let index = samples.clone().position(|logits| !is_valid(logits));
    let index = index.expect("a sample is below the horizon");
    let [theta_h, theta_d, _] = angles(samples.nth(index).expect("the index is valid"));
    // d(0.005 theta^2) / d(logit), theta = pi/2 sigmoid(logit)
    let slope = |theta: f64| 2.0 * BARRIER * theta * theta * (1.0 - theta / FRAC_PI_2);
    let expected = [slope(theta_h), slope(theta_d), 0.0];
    for (actual, expected) in by_logits[3 * index..].iter().zip(expected) {
        assert!((actual - expected).abs() <= 1e-6 * expected);
    }
    let barrier = BARRIER * (theta_h * theta_h + theta_d * theta_d);
    assert!((f64::from(pattern.barrier()) - barrier).abs() < 1e-6 * barrier);
}

/// Tests the chain rule from directions to logits with random gradients with respect to the directions.
#[test]
fn gradient_by_logits_follows_the_chain_rule() {
    for seed in 0..50 {
        let (mut random, logits, pattern) = pattern_with_one_below_horizon(seed);
        let by_sample = random_gradient(&mut random);
        let by_logits = to_f64(
            &pattern.gradient_by_logits(|index| pattern.gradient_by_angles(&[by_sample], index)),
        );

        let by_logits = by_logits.as_chunks::<3>().0.iter();
        for (lane, (actual, logits)) in by_logits.zip(&logits).enumerate() {
            let logits = logits.map(f64::from);
            if !is_valid(logits) {
                continue;
            }
            // The sum of coordinates times their derivatives.
            let product = |logits: [f64; 3]| {
                let coordinates = half_difference(logits).to_array().into_iter();
                let terms = coordinates.zip(by_sample.at.to_array());
                terms
                    .map(|(x, slope)| x * f64::from(slope.0[lane]))
                    .sum::<f64>()
            };
            for (i, actual) in actual.iter().enumerate() {
                let product_at = |offset: f64| {
                    let mut logits = logits;
                    logits[i] += offset;
                    product(logits)
                };
                let error = (actual - (product_at(1e-4) - product_at(-1e-4)) / 2e-4).abs();
                assert!(
                    error < 1e-4,
                    "seed {seed}, sample {lane}, logit {i}: {error}"
                );
            }
        }
    }
}

#[test]
fn angles_and_logits_round_trip() {
    for original in sobol_valid(1000, 1) {
        let logits = Reach::ANY.logits(original);
        let actual = Reach::ANY.angles(logits);
        let expected = angles(logits.map(f64::from));
        let actual = actual.to_array();
        let original = original.to_array();
        let ranges = [FRAC_PI_2, FRAC_PI_2, PI];
        for i in 0..3 {
            assert!((f64::from(actual[i]) - expected[i]).abs() < 1e-6);
            // Angles are clamped to 0.1 % to 99.9 % of their range.
            let clamped = f64::from(original[i]).clamp(1e-3 * ranges[i], (1.0 - 1e-3) * ranges[i]);
            assert!((f64::from(actual[i]) - clamped).abs() < 1e-6);
        }
    }
}
