//! The sample patterns of the method NJR15 (Nielsen et al. 2015).

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_fitting::linear::ComponentsAt;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::min_condition_pattern;
use nalgebra::DMatrix;

use super::basis;
use crate::support::assert_independent_of_threads;

/// Returns the condition number of a reduced basis.
fn condition(basis: &BasisTable, pattern: &[Angles<f32>]) -> f64 {
    let at = ComponentsAt::new(basis, pattern.to_vec());
    let rows: Vec<f64> = at.rows.iter().copied().map(f64::from).collect();
    let (samples, components) = (pattern.len(), basis.components());
    let matrix = DMatrix::from_row_slice(samples, components, &rows);
    let values = matrix.singular_values();
    assert_eq!(values.len(), samples.min(components));
    values.max() / values.min()
}

#[test]
fn patterns_are_better_conditioned_than_random_ones() {
    for (samples, components) in [(3, 5), (5, 5), (8, 5), (8, 12), (16, 12)] {
        let basis = basis(components);
        for seed in 0..3 {
            let pattern = min_condition_pattern(&basis, samples, seed);
            assert_eq!(pattern.len(), samples);
            let mut directions = pattern.iter().copied().map(HalfDifference::from_angles);
            assert!(directions.all(|at| at.is_valid()));
            let actual = condition(&basis, &pattern);
            let random = uniform_valid(50 * samples, 1_000 + seed);
            let best_random = random
                .chunks(samples)
                .map(|pattern| condition(&basis, pattern))
                .fold(f64::INFINITY, f64::min);
            assert!(
                actual < best_random,
                "n = {samples}, m = {components}: {actual}, {best_random}"
            );
        }
    }
}

#[test]
fn pattern_depends_on_the_seed_only() {
    let basis = basis(5);
    let pattern =
        assert_independent_of_threads("a pattern", || min_condition_pattern(&basis, 8, 4));
    assert_ne!(pattern, min_condition_pattern(&basis, 8, 5));
}
