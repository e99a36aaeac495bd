//! Values at nodes whose interpolation comes nearest to what is known in between.

/// A linear system in the sense of least squares: known is what an interpolation of the unknowns
/// gives, and that neighbors differ little where nothing else is said of them.
pub(super) struct LeastSquares {
    /// The unknowns of each interpolation, and their shares.
    rows: Vec<[(u32, f32); 8]>,
    /// Neighbors.
    pairs: Vec<(u32, u32)>,
    /// The weight of a pair beside that of a row.
    smoothness: f64,
    /// The diagonal of the normal equations; 1 where it would be 0.
    diagonal: Vec<f64>,
}

/// Steps of conjugate gradients at most; a few dozen are enough.
const STEPS: usize = 200;
/// What is left of the residual's norm, squared, when they end.
const LEFT: f64 = 1e-10;

impl LeastSquares {
    pub(super) fn new(
        unknowns: usize,
        rows: Vec<[(u32, f32); 8]>,
        pairs: Vec<(u32, u32)>,
        smoothness: f64,
    ) -> Self {
        // As many equal unknowns as there may be in a row count together.
        let mut diagonal = vec![0.0; unknowns];
        for row in &rows {
            for (one, share) in row {
                for (other, factor) in row {
                    if one == other {
                        diagonal[*one as usize] += f64::from(*share) * f64::from(*factor);
                    }
                }
            }
        }
        for (one, other) in &pairs {
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
            pairs,
            smoothness,
            diagonal,
        }
    }

    /// The unknowns, for a known value in each row: by conjugate gradients on the normal
    /// equations, their diagonal as preconditioner. An unknown that nothing is said of is 0.
    pub(super) fn solve(&self, known: &[f32]) -> Vec<f64> {
        let mut unknowns = vec![0.0; self.diagonal.len()];
        let mut residual = unknowns.clone();
        for (row, known) in self.rows.iter().zip(known) {
            scatter(row, f64::from(*known), &mut residual);
        }
        let mut direction = self.preconditioned(&residual);
        let mut norm = dot(&residual, &direction);
        let enough = LEFT * norm;
        for _ in 0..STEPS {
            if norm <= enough {
                break;
            }
            let product = self.product(&direction);
            let step = norm / dot(&direction, &product);
            for (entry, along) in unknowns.iter_mut().zip(&direction) {
                *entry += step * along;
            }
            for (entry, along) in residual.iter_mut().zip(&product) {
                *entry -= step * along;
            }
            let downhill = self.preconditioned(&residual);
            let next = dot(&residual, &downhill);
            for (entry, downhill) in direction.iter_mut().zip(downhill) {
                *entry = downhill + next / norm * *entry;
            }
            norm = next;
        }
        unknowns
    }

    fn preconditioned(&self, vector: &[f64]) -> Vec<f64> {
        let pairs = vector.iter().zip(&self.diagonal);
        pairs.map(|(entry, diagonal)| entry / diagonal).collect()
    }

    /// The normal equations' matrix times a vector.
    fn product(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; vector.len()];
        for row in &self.rows {
            let terms = row
                .iter()
                .map(|(unknown, share)| f64::from(*share) * vector[*unknown as usize]);
            scatter(row, terms.sum(), &mut product);
        }
        for (one, other) in &self.pairs {
            let (one, other) = (*one as usize, *other as usize);
            let pull = self.smoothness * (vector[one] - vector[other]);
            product[one] += pull;
            product[other] -= pull;
        }
        product
    }
}

/// sum += row * factor
fn scatter(row: &[(u32, f32); 8], factor: f64, sum: &mut [f64]) {
    for (unknown, share) in row {
        sum[*unknown as usize] += f64::from(*share) * factor;
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows that see one unknown each.
    fn sees(unknown: u32) -> [(u32, f32); 8] {
        let mut row = [(unknown, 0.0); 8];
        row[0].1 = 1.0;
        row
    }

    #[test]
    fn what_is_said_twice_is_averaged_and_what_is_not_said_is_between_its_neighbors() {
        let rows = vec![sees(0), sees(0), sees(2)];
        let system = LeastSquares::new(4, rows, vec![(0, 1), (1, 2)], 1e-9);
        let found = system.solve(&[1.0, 3.0, 6.0]);
        for (found, expected) in found.into_iter().zip([2.0, 4.0, 6.0, 0.0]) {
            assert!(
                (found - expected).abs() < 1e-6,
                "{found} and not {expected}"
            );
        }
    }

    #[test]
    fn an_interpolation_is_undone() {
        // Between unknowns k and k + 1, at many places; unknown 5 is unknown 4 again.
        let values = [1.0, -2.0, 0.5, 4.0, 3.0_f32];
        let (mut rows, mut known) = (Vec::new(), Vec::new());
        for place in 0..40 {
            let along = place as f32 * 0.13;
            let (low, share) = (along as u32, along.fract());
            let [low, high] = [low.min(4), (low + 1).min(4)];
            let mut row = [(low, 0.0); 8];
            row[0].1 = 1.0 - share;
            row[7] = (high, share);
            rows.push(row);
            known.push(values[low as usize] * (1.0 - share) + values[high as usize] * share);
        }
        let found = LeastSquares::new(5, rows, Vec::new(), 0.0).solve(&known);
        for (found, expected) in found.iter().zip(values) {
            assert!(
                (found - f64::from(expected)).abs() < 1e-4,
                "{found} and not {expected}"
            );
        }
    }
}
