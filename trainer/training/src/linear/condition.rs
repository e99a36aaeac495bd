//! The method NJR15: samples that make the ridge problem well conditioned (Nielsen et al. 2015).

use glimpse_core::geometry::Angles;
use glimpse_materials::basis::{Basis, widened};
use glimpse_materials::sampling::uniform_valid;
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Reduced;

/// Directions to choose from.
const CANDIDATES: usize = 4_096;
/// Random patterns that compete before the best is improved.
const STARTS: usize = 50;
/// How often each sample is reconsidered, and with how many candidates each time.
const SWEEPS: usize = 12;
const TRIES: usize = 64;

/// A pattern of n samples whose reduced basis has a small condition number: of the best of many
/// random ones, each sample in turn is exchanged for the best of random candidates, as long as
/// that helps.
#[must_use]
pub fn least_condition(basis: &Basis, samples: usize, seed: u64) -> Vec<Angles<f32>> {
    let candidates = uniform_valid(CANDIDATES, seed);
    let places: Vec<Angles<f64>> = candidates.iter().map(widened).collect();
    let rows: Vec<DVector<f64>> = Reduced::new(basis, &places)
        .basis
        .chunks(basis.components())
        .map(DVector::from_row_slice)
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || random.random_range(0..CANDIDATES);
    let starts = (0..STARTS).map(|_| (0..samples).map(|_| draw()).collect::<Vec<usize>>());
    let mut best = (f64::INFINITY, vec![0; samples]);
    for chosen in starts.collect::<Vec<_>>() {
        let found = Gram::new(&rows, &chosen).condition();
        if found < best.0 {
            best = (found, chosen);
        }
    }
    let (mut least, mut chosen) = best;
    for _ in 0..SWEEPS {
        let before = least;
        for sample in 0..samples {
            for _ in 0..TRIES {
                let mut other = chosen.clone();
                other[sample] = draw();
                let found = Gram::new(&rows, &other).condition();
                if found < least {
                    (least, chosen) = (found, other);
                }
            }
        }
        if least >= before {
            break;
        }
    }
    chosen.into_iter().map(|index| candidates[index]).collect()
}

/// A'A or A A', whichever is smaller: both have the same eigenvalues but for zeros.
struct Gram(DMatrix<f64>);

impl Gram {
    fn new(rows: &[DVector<f64>], chosen: &[usize]) -> Self {
        let components = rows.first().map_or(0, DVector::len);
        if chosen.len() < components {
            let entry = |i: usize, j: usize| rows[chosen[i]].dot(&rows[chosen[j]]);
            return Self(DMatrix::from_fn(chosen.len(), chosen.len(), entry));
        }
        let mut sum = DMatrix::zeros(components, components);
        for index in chosen {
            sum.ger(1.0, &rows[*index], &rows[*index], 1.0);
        }
        Self(sum)
    }

    /// The ratio of A's largest to its smallest singular value.
    fn condition(self) -> f64 {
        let eigenvalues = self.0.symmetric_eigenvalues();
        (eigenvalues.max() / eigenvalues.min().max(0.0)).sqrt()
    }
}
