//! The method NJR15: sample directions for a well-conditioned ridge problem (Nielsen et al. 2015).

use glimpse_core::geometry::Angles;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The number of candidate directions.
const CANDIDATES: usize = 4_096;
/// The number of random initial patterns. Sweeps improve the best one.
const INITIAL_PATTERNS: usize = 50;
/// The largest number of sweeps over the samples.
const SWEEPS: usize = 12;
/// The number of candidates that a sweep tries in place of each sample.
const TRIES: usize = 64;

/// Returns a pattern whose reduced basis has a small condition number.
///
/// The search starts from the best of several random patterns. Sweeps replace a sample with a random candidate if that
/// reduces the condition number. The search ends when a sweep finds no improvement.
#[must_use]
pub fn min_condition_pattern(basis: &BasisTable, samples: usize, seed: u64) -> Vec<Angles<f32>> {
    let candidates = uniform_valid(CANDIDATES, seed);
    let rows: Vec<DVector<f64>> = ComponentsAt::new(basis, candidates.clone())
        .rows
        .chunks(basis.components())
        .map(|row| DVector::from_iterator(row.len(), row.iter().copied().map(f64::from)))
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || random.random_range(0..CANDIDATES);
    let initial =
        (0..INITIAL_PATTERNS).map(|_| (0..samples).map(|_| draw()).collect::<Vec<usize>>());
    let (mut min_condition, mut pattern) = (f64::INFINITY, vec![0; samples]);
    for candidate in initial.collect::<Vec<_>>() {
        let condition = condition(&rows, &candidate);
        if condition < min_condition {
            (min_condition, pattern) = (condition, candidate);
        }
    }
    for _ in 0..SWEEPS {
        let previous = min_condition;
        for sample in 0..samples {
            for _ in 0..TRIES {
                let mut candidate = pattern.clone();
                candidate[sample] = draw();
                let condition = condition(&rows, &candidate);
                if condition < min_condition {
                    (min_condition, pattern) = (condition, candidate);
                }
            }
        }
        if min_condition >= previous {
            break;
        }
    }
    pattern.into_iter().map(|index| candidates[index]).collect()
}

/// Returns the ratio of the largest to the smallest singular value of A, the reduced basis of a pattern: the square root of
/// that of the eigenvalues of the smaller one of A'A and A A'. Their nonzero eigenvalues are equal.
fn condition(rows: &[DVector<f64>], pattern: &[usize]) -> f64 {
    let components = rows.first().map_or(0, DVector::len);
    let gram = if pattern.len() < components {
        let entry = |i: usize, j: usize| rows[pattern[i]].dot(&rows[pattern[j]]);
        DMatrix::from_fn(pattern.len(), pattern.len(), entry)
    } else {
        let mut sum = DMatrix::zeros(components, components);
        for index in pattern {
            sum.ger(1.0, &rows[*index], &rows[*index], 1.0);
        }
        sum
    };
    let eigenvalues = gram.symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min().max(0.0)).sqrt()
}
