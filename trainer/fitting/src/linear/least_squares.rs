//! A least-squares fit of the values at nodes to known values of their interpolation.

use glimpse_materials::lists::{add_scaled, dot};

/// A sparse linear least-squares system. Each row is an interpolation of unknowns with a known value. A smoothness term
/// penalizes differences between neighbors.
pub(super) struct LeastSquares {
    /// The unknowns of each interpolation, with their weights.
    rows: Vec<[(u32, f32); 8]>,
    /// Pairs of neighboring unknowns.
    neighbors: Vec<(u32, u32)>,
    /// The weight of a pair of neighbors, relative to a row.
    smoothness: f64,
    /// The diagonal of the normal equations, with zeros replaced by 1.
    diagonal: Vec<f64>,
}

/// The largest number of conjugate gradient steps; a few dozen are usually enough.
const MAX_STEPS: usize = 200;
/// The relative squared norm of the residual at which the steps end.
const TOLERANCE: f64 = 1e-10;

impl LeastSquares {
    pub(super) fn new(
        unknowns: usize,
        rows: Vec<[(u32, f32); 8]>,
        neighbors: Vec<(u32, u32)>,
        smoothness: f64,
    ) -> Self {
        // A row may contain an unknown several times; its weights then add up.
        let mut diagonal = vec![0.0; unknowns];
        for row in &rows {
            for (one, weight) in row {
                for (_, factor) in row.iter().filter(|(other, _)| one == other) {
                    diagonal[*one as usize] += f64::from(*weight) * f64::from(*factor);
                }
            }
        }
        for (one, other) in &neighbors {
            diagonal[*one as usize] += smoothness;
            diagonal[*other as usize] += smoothness;
        }
        for entry in &mut diagonal {
            if *entry == 0.0 {
                *entry = 1.0;
            }
        }
        Self {
            rows,
            neighbors,
            smoothness,
            diagonal,
        }
    }

    /// Returns the unknowns, given the value of each row. Runs conjugate gradients on the normal equations with their
    /// diagonal as preconditioner. An unknown without rows and neighbors is 0.
    pub(super) fn solve(&self, values: &[f32]) -> Vec<f64> {
        let mut unknowns = vec![0.0; self.diagonal.len()];
        let mut residual = unknowns.clone();
        for (row, value) in self.rows.iter().zip(values) {
            scatter(row, f64::from(*value), &mut residual);
        }
        let mut direction = self.precondition(&residual);
        let mut norm = dot(&residual, &direction);
        let threshold = TOLERANCE * norm;
        for _ in 0..MAX_STEPS {
            if norm <= threshold {
                break;
            }
            let product = self.multiply(&direction);
            let step = norm / dot(&direction, &product);
            add_scaled(&mut unknowns, step, &direction);
            add_scaled(&mut residual, -step, &product);
            let preconditioned = self.precondition(&residual);
            let next_norm = dot(&residual, &preconditioned);
            for (entry, preconditioned) in direction.iter_mut().zip(preconditioned) {
                *entry = preconditioned + next_norm / norm * *entry;
            }
            norm = next_norm;
        }
        unknowns
    }

    fn precondition(&self, vector: &[f64]) -> Vec<f64> {
        let pairs = vector.iter().zip(&self.diagonal);
        pairs.map(|(entry, diagonal)| entry / diagonal).collect()
    }

    /// Returns the product of the matrix of the normal equations and a vector.
    fn multiply(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; vector.len()];
        for row in &self.rows {
            let terms = row
                .iter()
                .map(|(unknown, weight)| f64::from(*weight) * vector[*unknown as usize]);
            scatter(row, terms.sum(), &mut product);
        }
        for (one, other) in &self.neighbors {
            let (one, other) = (*one as usize, *other as usize);
            let difference = self.smoothness * (vector[one] - vector[other]);
            product[one] += difference;
            product[other] -= difference;
        }
        product
    }
}

/// Adds a row times a factor to `sum`.
fn scatter(row: &[(u32, f32); 8], factor: f64, sum: &mut [f64]) {
    for (unknown, weight) in row {
        sum[*unknown as usize] += f64::from(*weight) * factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a row of a single unknown.
    fn single(unknown: u32) -> [(u32, f32); 8] {
        let mut row = [(unknown, 0.0); 8];
        row[0].1 = 1.0;
        row
    }

    #[test]
    fn solve_averages_repeated_rows_and_interpolates_unknowns_without_rows() {
        let rows = vec![single(0), single(0), single(2)];
        let system = LeastSquares::new(4, rows, vec![(0, 1), (1, 2)], 1e-9);
        let solution = system.solve(&[1.0, 3.0, 6.0]);
        for (actual, expected) in solution.into_iter().zip([2.0, 4.0, 6.0, 0.0]) {
            assert!(
                (actual - expected).abs() < 1e-6,
                "{actual} instead of {expected}"
            );
        }
    }
}
