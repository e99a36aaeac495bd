//! The method NJR15.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::basis::{Basis, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::{ReducedBasis, min_condition_pattern};
use nalgebra::DMatrix;

use super::basis;

/// The ratio of largest to smallest singular value of a reduced basis.
fn condition(basis: &Basis, pattern: &[Angles<f32>]) -> f64 {
    let places: Vec<Angles<f64>> = pattern.iter().map(angles_to_f64).collect();
    let reduced = ReducedBasis::new(basis, &places);
    let (samples, components) = (pattern.len(), basis.components());
    let matrix = DMatrix::from_row_slice(samples, components, &reduced.basis);
    let values = matrix.singular_values();
    assert_eq!(values.len(), samples.min(components));
    values.max() / values.min()
}

#[test]
fn its_patterns_are_better_conditioned_than_random_ones() {
    for (samples, components) in [(3, 5), (5, 5), (8, 5), (8, 12), (16, 12)] {
        let basis = basis(components);
        for seed in 0..3 {
            let pattern = min_condition_pattern(&basis, samples, seed);
            assert_eq!(pattern.len(), samples);
            let places = pattern.iter().copied().map(HalfDifference::from_angles);
            assert!(places.into_iter().all(|at| at.is_valid()));
            let found = condition(&basis, &pattern);
            let random = uniform_valid(50 * samples, 1_000 + seed);
            let best = random
                .chunks(samples)
                .map(|pattern| condition(&basis, pattern))
                .fold(f64::INFINITY, f64::min);
            println!("n = {samples}, m = {components}: {found:.3}, the best of 50 {best:.3}");
            assert!(found < best, "{found} and {best}");
        }
    }
}

#[test]
fn a_seed_gives_the_same_pattern_each_time() {
    let basis = basis(5);
    let found = min_condition_pattern(&basis, 8, 4);
    assert_eq!(found, min_condition_pattern(&basis, 8, 4));
    assert_ne!(found, min_condition_pattern(&basis, 8, 5));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let alone = pool
        .expect("threads start")
        .install(|| min_condition_pattern(&basis, 8, 4));
    assert_eq!(found, alone);
}
