//! Problems, an independent solve in f64, and the crate's solve.

use glimpse_core::fit::ridge::{Factors, Problem, Real, RidgeError, factor_length, scratch_length};

use crate::completion::reference::solve;
use crate::random::Random;

/// A realistic problem. Singular values from 10 to 0.1 scale the components. The measurements are those of materials
/// that follow the prior, with noise. All numbers are exact in f32.
pub(crate) struct Case {
    pub(crate) m: usize,
    pub(crate) basis: Vec<f64>,
    pub(crate) precision: Vec<f64>,
    pub(crate) mapped: Vec<f64>,
}

impl Case {
    /// `smooth` makes neighboring rows similar, like those of neighboring directions. The problem is then worse
    /// conditioned.
    pub(crate) fn new(
        n: usize,
        m: usize,
        precision: impl Fn(usize) -> f64,
        smooth: bool,
        seed: u64,
    ) -> Self {
        let mut random = Random(seed);
        let round = |x: f64| f64::from(x as f32);
        let scale = |k: usize| 10.0 * 0.01_f64.powf(k as f64 / (m.max(2) - 1) as f64);
        let phases: Vec<f64> = (0..m).map(|_| 6.3 * random.uniform()).collect();
        let positions: Vec<f64> = (0..n).map(|_| random.uniform()).collect();
        let mut basis = Vec::new();
        for position in &positions {
            for (k, phase) in phases.iter().enumerate() {
                let shape = if smooth {
                    (position * 0.3 * (k + 1) as f64 + phase).sin()
                } else {
                    random.normal()
                };
                basis.push(round(scale(k) * shape));
            }
        }
        let precision: Vec<f64> = (0..m).map(|k| round(precision(k))).collect();
        let truth: Vec<f64> = (0..m).map(|_| 0.3 * random.normal()).collect();
        let mapped = basis
            .chunks(m)
            .map(|row| {
                let exact: f64 = row.iter().zip(&truth).map(|(a, c)| a * c).sum();
                round(exact + 0.05 * random.normal())
            })
            .collect();
        Self {
            m,
            basis,
            precision,
            mapped,
        }
    }

    /// (A'A + P)^-1 b by an independent method: elimination in f64, and one refinement.
    pub(crate) fn reference(&self, right: &[f64]) -> Vec<f64> {
        let product = |k: usize, l: usize| -> f64 {
            let columns = self.basis.chunks(self.m).map(|row| row[k] * row[l]);
            let diagonal = if k == l { self.precision[k] } else { 0.0 };
            columns.sum::<f64>() + diagonal
        };
        let matrix: Vec<Vec<f64>> = (0..self.m)
            .map(|k| (0..self.m).map(|l| product(k, l)).collect())
            .collect();
        let mut solution = solve(matrix.clone(), right.to_vec());
        let residual: Vec<f64> = (0..self.m)
            .map(|k| right[k] - (0..self.m).map(|l| matrix[k][l] * solution[l]).sum::<f64>())
            .collect();
        for (x, correction) in solution.iter_mut().zip(solve(matrix, residual)) {
            *x += correction;
        }
        solution
    }

    /// The right-hand side A't.
    pub(crate) fn right_hand_side(&self) -> Vec<f64> {
        let rows = || self.basis.chunks(self.m).zip(&self.mapped);
        (0..self.m)
            .map(|k| rows().map(|(row, t)| row[k] * t).sum())
            .collect()
    }
}

pub(crate) fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|x| *x as f32).collect()
}

/// Factorizes, and calls `then` with the factors and scratch memory.
pub(crate) fn with_factors<S: Real, R>(
    basis: &[S],
    precision: &[S],
    then: impl FnOnce(&Factors<'_, '_, S, S>, &mut [S]) -> R,
) -> Result<R, RidgeError> {
    let problem = Problem::new(basis, precision)?;
    let (n, m) = (problem.samples(), problem.components());
    let mut memory = vec![S::constant(f64::NAN); factor_length(n, m)];
    let mut scratch = vec![S::constant(f64::NAN); scratch_length(n, m)];
    let factors = problem.factorize(&mut memory, &mut scratch)?;
    Ok(then(&factors, &mut scratch))
}

/// The coefficients for t, and the solution for lambda.
pub(crate) fn solutions<S: Real>(
    basis: &[S],
    precision: &[S],
    mapped: &[S],
    lambda: &[S],
) -> (Vec<S>, Vec<S>) {
    with_factors(basis, precision, |factors, scratch| {
        let mut coefficients = vec![S::constant(f64::NAN); precision.len()];
        let mut solution = coefficients.clone();
        factors
            .coefficients(mapped, &mut coefficients, scratch)
            .unwrap();
        factors.solve(lambda, &mut solution, scratch).unwrap();
        (coefficients, solution)
    })
    .unwrap()
}

/// The relative distance |a - b| / |b|.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

pub(crate) fn to_f64(values: &[f32]) -> Vec<f64> {
    values.iter().copied().map(f64::from).collect()
}
