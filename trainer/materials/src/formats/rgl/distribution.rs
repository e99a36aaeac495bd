//! Bilinear functions on the unit square, and the cumulative distributions of densities.

use glimpse_core::numeric::Scalar;

use glimpse_kernels::dual::RealScalar;

use crate::interpolation::{Position, mix};

/// The position of a point in the unit square between columns and between rows.
pub(super) type Cell<S> = [Position<S>; 2];

/// The numbers of columns (along x) and rows (along y) of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TableShape {
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl TableShape {
    /// Returns the number of nodes of one slice.
    pub(super) fn nodes(self) -> usize {
        self.columns * self.rows
    }

    /// Returns the cell of the point (x, y). The table has at least 2 columns and 2 rows.
    #[inline(always)]
    pub(super) fn cell<S: RealScalar>(self, [x, y]: [S; 2]) -> Cell<S> {
        [
            Position::uniform(x, self.columns),
            Position::uniform(y, self.rows),
        ]
    }

    /// Evaluates the bilinear function of a slice's values at a point.
    #[inline(always)]
    pub(super) fn at<S: RealScalar>(self, slice: &[f32], point: [S; 2]) -> S {
        self.evaluate(slice, &self.cell(point))
    }

    /// Evaluates the bilinear function of a slice's values in a cell.
    #[inline(always)]
    pub(super) fn evaluate<S: RealScalar>(self, slice: &[f32], [x, y]: &Cell<S>) -> S {
        y.mix(|row| x.mix(|column| value_or_zero(slice, column + row * self.columns)))
    }
}

/// Returns a value of an array, or 0 past its end. The reader checks the lengths, so that no index is past the end.
#[inline(always)]
fn value_or_zero<S: Scalar>(values: &[f32], index: usize) -> S {
    S::constant(values.get(index).copied().unwrap_or(0.0).into())
}

/// Densities on the unit square, one for each slice, interpolated linearly between slices and between nodes.
pub(super) struct Densities {
    shape: TableShape,
    /// Values of all slices. The integral of each slice is 1.
    density: Vec<f32>,
    /// Integrals of each row from its start to each node.
    conditional: Vec<f32>,
    /// Integrals of each slice up to each row.
    marginal: Vec<f32>,
}

impl Densities {
    /// Normalizes slices of values. In integrals, neighboring nodes have distance 1. The trapezoidal rule is exact,
    /// because the functions are piecewise linear.
    pub(super) fn new(shape: TableShape, mut density: Vec<f32>) -> Self {
        let mut conditional = Vec::with_capacity(density.len());
        let mut marginal = Vec::with_capacity(density.len() / shape.columns);
        for slice in density.chunks_exact_mut(shape.nodes()) {
            let rows = slice.chunks_exact(shape.columns);
            let rows =
                rows.map(|row| cumulative_integrals(row.iter().map(|value| (*value).into())));
            let rows: Vec<Vec<f64>> = rows.collect();
            let below = cumulative_integrals(rows.iter().map(|row| row[shape.columns - 1]));
            let total = below[shape.rows - 1];
            let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
            let rows = rows.into_iter().flatten();
            conditional.extend(rows.map(|sum| (sum * scale) as f32));
            marginal.extend(below.into_iter().map(|sum| (sum * scale) as f32));
            for value in slice {
                *value = (f64::from(*value) * scale) as f32;
            }
        }
        Self {
            shape,
            density,
            conditional,
            marginal,
        }
    }

    /// Maps a point so that the density becomes uniform. The new y is the integral below the row, and the new x is the
    /// fraction of the row's integral before the point.
    #[inline(always)]
    pub(super) fn map_to_uniform<S: RealScalar>(
        &self,
        point: [S; 2],
        position: &Position<S>,
    ) -> [S; 2] {
        let TableShape { columns, rows } = self.shape;
        let cell = self.shape.cell(point);
        let [(column, x), (row, y)] = cell.map(|axis| (axis.nodes[0], axis.weights[1]));
        // Density and integrals at a node, interpolated between the two slices.
        let first_node = column + row * columns;
        let integral = |node: usize| {
            position
                .mix(|slice| value_or_zero(&self.conditional, slice * self.shape.nodes() + node))
        };
        let density = |node: usize| {
            position.mix(|slice| value_or_zero(&self.density, slice * self.shape.nodes() + node))
        };
        let below = position.mix(|slice| value_or_zero(&self.marginal, slice * rows + row));

        let integral_in_row = |node: usize| {
            let left = density(node);
            let right = density(node + 1);
            integral(node) + x * mean_up_to(left, right, x)
        };
        let integral_before = mix(
            integral_in_row(first_node),
            integral_in_row(first_node + columns),
            y,
        );
        let end_of_row = row * columns + columns - 1;
        let [low, high] = [integral(end_of_row), integral(end_of_row + columns)];
        let row_integral = mix(low, high, y);
        // A row without density is never sampled, and its points are mapped to x = 0.
        let divisor = row_integral.if_positive(row_integral, S::constant(1.0));
        [
            integral_before / divisor,
            below + y * mean_up_to(low, high, y),
        ]
    }

    /// Returns the points that [`Densities::map_to_uniform`] maps to `side` x `side` evenly spaced points, x fastest.
    /// The first slice is the density. Every row must have a positive integral.
    pub(super) fn grid_points(&self, side: usize) -> Vec<[f64; 2]> {
        let TableShape { columns, rows } = self.shape;
        let coordinate = |node: usize| node as f64 / (side - 1) as f64;
        let mixed_row = |values: &[f32], row: usize, fraction: f64| -> Vec<f64> {
            let lower_nodes = (0..columns).map(|column| column + row * columns);
            lower_nodes
                .map(|low| {
                    mix(
                        value_or_zero(values, low),
                        value_or_zero(values, low + self.shape.columns),
                        fraction,
                    )
                })
                .collect()
        };
        let below: Vec<f64> = (0..rows)
            .map(|row| value_or_zero(&self.marginal, row))
            .collect();
        let row_integrals: Vec<f64> = (0..rows)
            .map(|row| value_or_zero(&self.conditional, (row + 1) * columns - 1))
            .collect();
        let mut points = Vec::with_capacity(side * side);
        for y in (0..side).map(coordinate) {
            let (row, fraction) = invert_integral(y, &below, &row_integrals);
            let integral = mixed_row(&self.conditional, row, fraction);
            let density = mixed_row(&self.density, row, fraction);
            let row_integral = integral.last().copied().unwrap_or(0.0);
            let v = (row as f64 + fraction) / (rows - 1) as f64;
            points.extend((0..side).map(coordinate).map(|x| {
                let (column, fraction) = invert_integral(x * row_integral, &integral, &density);
                [(column as f64 + fraction) / (columns - 1) as f64, v]
            }));
        }
        points
    }
}

/// Returns the position at which the integral of a piecewise linear function reaches `area`: the index of the node
/// before, and the fraction of the way to the next node. `values` and `integrals` are the function and its integral at
/// each node.
fn invert_integral(area: f64, integrals: &[f64], values: &[f64]) -> (usize, f64) {
    let after = integrals.partition_point(|integral| *integral <= area);
    let low = after.saturating_sub(1).min(integrals.len() - 2);
    let (left, right) = (values[low], values[low + 1]);
    let remaining = (area - integrals[low]).max(0.0);
    // The solution of left s + (right - left) s^2 / 2 = remaining, without a division by 0 for equal values.
    let root = (left * left + 2.0 * (right - left) * remaining)
        .max(0.0)
        .sqrt();
    let fraction = if left + root > 0.0 {
        2.0 * remaining / (left + root)
    } else {
        0.0
    };
    (low, fraction.min(1.0))
}

/// Returns the mean of a linear function from a node to the point at a `fraction` of the way to the next node.
#[inline(always)]
fn mean_up_to<S: Scalar>(left: S, right: S, fraction: S) -> S {
    left + S::constant(0.5) * fraction * (right - left)
}

/// Returns the integrals of a piecewise linear function up to each value. Neighboring values have distance 1.
fn cumulative_integrals(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (mut sum, mut previous) = (0.0, None);
    let integrals = values.map(|value| {
        sum += previous.map_or(0.0, |previous| 0.5 * (previous + value));
        previous = Some(value);
        sum
    });
    integrals.collect()
}
