//! Functions on the unit square, bilinear between nodes, and the mapping that makes a density
//! uniform.

use glimpse_core::numeric::Scalar;

use super::angular::Angular;

/// The nodes around a point of the unit square, and its place among them.
#[derive(Clone, Copy)]
pub(super) struct Cell<S> {
    /// Column and row of the lower node.
    column: usize,
    row: usize,
    /// How far it is to the upper nodes, in \[0, 1\].
    x: S,
    y: S,
}

impl<S: Angular> Cell<S> {
    /// The cell of the point (x, y), in a grid of so many columns and rows, both at least 2.
    #[inline(always)]
    pub(super) fn of([x, y]: [S; 2], grid: TableShape) -> Self {
        let (column, x) = split(x, grid.columns);
        let (row, y) = split(y, grid.rows);
        Self { column, row, x, y }
    }
}

/// Index of the node before a coordinate of \[0, 1\], and the place between it and the next one.
#[inline(always)]
fn split<S: Angular>(coordinate: S, nodes: usize) -> (usize, S) {
    let position = coordinate * S::constant((nodes - 1) as f64);
    let index = (position.value() as usize).min(nodes - 2);
    (index, position - S::constant(index as f64))
}

/// `a` at share 0, `b` at share 1.
#[inline(always)]
fn mix<S: Scalar>(a: S, b: S, share: S) -> S {
    a.plus_product(b - a, share)
}

/// Columns and rows of nodes; x is along the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TableShape {
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl TableShape {
    /// Nodes of one slice.
    pub(super) fn nodes(self) -> usize {
        self.columns * self.rows
    }

    /// The values at a cell's four nodes: lower row, then upper row.
    #[inline(always)]
    fn corners<S: Angular>(self, slice: &[f32], cell: &Cell<S>) -> [[S; 2]; 2] {
        let low = cell.column + cell.row * self.columns;
        [low, low + self.columns].map(|index| [index, index + 1].map(|index| at(slice, index)))
    }

    /// The bilinear function in a slice of values.
    #[inline(always)]
    pub(super) fn evaluate<S: Angular>(self, slice: &[f32], cell: &Cell<S>) -> S {
        let [low, high] = self.corners(slice, cell);
        mix(
            mix(low[0], low[1], cell.x),
            mix(high[0], high[1], cell.x),
            cell.y,
        )
    }
}

/// A value of an array; 0 past its end, which the reader's checks have excluded.
#[inline(always)]
fn at<S: Scalar>(values: &[f32], index: usize) -> S {
    S::constant(values.get(index).copied().unwrap_or(0.0).into())
}

/// Two neighboring slices of an array, and where between them.
#[derive(Clone, Copy)]
pub(super) struct Between<S> {
    /// Index of the lower slice and of the upper one; the same for the only one.
    pub(super) slices: [usize; 2],
    /// The upper one's share.
    pub(super) share: S,
}

impl<S: Angular> Between<S> {
    /// Where `coordinate` is among increasing nodes; before the first and past the last one it
    /// stays there.
    #[inline(always)]
    pub(super) fn of(coordinate: S, nodes: &[f32]) -> Self {
        let value = coordinate.value();
        let after = nodes.partition_point(|node| f64::from(*node) <= value);
        let low = after.saturating_sub(1);
        match (nodes.get(low), nodes.get(after)) {
            (Some(begin), Some(end)) if after > 0 => {
                let (begin, end) = (f64::from(*begin), f64::from(*end));
                let share = (coordinate - S::constant(begin)) * S::constant(1.0 / (end - begin));
                Self {
                    slices: [low, after],
                    share,
                }
            }
            _ => Self {
                slices: [low; 2],
                share: S::constant(0.0),
            },
        }
    }

    /// What `of_slice` gives, between the two.
    #[inline(always)]
    pub(super) fn mix(&self, of_slice: impl Fn(usize) -> S) -> S {
        let [low, high] = self.slices.map(of_slice);
        mix(low, high, self.share)
    }
}

/// Densities on the unit square, one a slice, linear between slices as between nodes.
pub(super) struct Densities {
    grid: TableShape,
    /// All slices' values, each slice scaled so that its whole is 1.
    density: Vec<f32>,
    /// For each row, the integral from its beginning to each node.
    conditional: Vec<f32>,
    /// For each slice, the integral up to each row.
    marginal: Vec<f32>,
}

impl Densities {
    /// From slices of values. Integrals are in units of nodes, by the trapezoidal rule, which is
    /// exact for what is linear.
    pub(super) fn new(grid: TableShape, mut density: Vec<f32>) -> Self {
        let mut conditional = Vec::with_capacity(density.len());
        let mut marginal = Vec::with_capacity(density.len() / grid.columns);
        for slice in density.chunks_exact_mut(grid.nodes()) {
            let rows = slice.chunks_exact(grid.columns);
            let wholes: Vec<f64> = rows
                .map(|row| whole(cumulate(row.iter().map(|value| f64::from(*value)))))
                .collect();
            let whole = whole(cumulate(wholes.iter().copied()));
            let scale = if whole > 0.0 { 1.0 / whole } else { 0.0 };
            for row in slice.chunks_exact(grid.columns) {
                let row = row.iter().map(|value| f64::from(*value));
                conditional.extend(cumulate(row).map(|sum| (sum * scale) as f32));
            }
            marginal.extend(cumulate(wholes.into_iter()).map(|sum| (sum * scale) as f32));
            for value in slice {
                *value = (f64::from(*value) * scale) as f32;
            }
        }
        Self {
            grid,
            density,
            conditional,
            marginal,
        }
    }

    /// Where the mapping that makes the density uniform takes a point: y becomes the share of the
    /// density below it, x the share along its row.
    #[inline(always)]
    pub(super) fn make_uniform<S: Angular>(&self, point: [S; 2], between: &Between<S>) -> [S; 2] {
        let TableShape { columns, rows } = self.grid;
        let cell = Cell::of(point, self.grid);
        // The density at the cell's nodes, and integrals, each between the two slices.
        let first = cell.column + cell.row * columns;
        let integral = |index: usize| {
            between.mix(|slice| at(&self.conditional, slice * self.grid.nodes() + index))
        };
        let density = |index: usize| {
            between.mix(|slice| at(&self.density, slice * self.grid.nodes() + index))
        };
        let below = between.mix(|slice| at(&self.marginal, slice * rows + cell.row));

        let along_row = |first: usize| {
            let left = density(first);
            let right = density(first + 1);
            integral(first) + cell.x * trapezoid(left, right, cell.x)
        };
        let share = mix(along_row(first), along_row(first + columns), cell.y);
        let end_of_row = cell.row * columns + columns - 1;
        let [low, high] = [integral(end_of_row), integral(end_of_row + columns)];
        let whole = mix(low, high, cell.y);
        // A row without any density is never sampled; its points have no better place than 0.
        let safe = whole.if_positive(whole, S::constant(1.0));
        [share / safe, below + cell.y * trapezoid(low, high, cell.y)]
    }

    /// The points that the first slice's mapping takes to the nodes of a square grid with so many in
    /// each direction, x fastest. Every row must have some density.
    pub(super) fn points_of_grid(&self, side: usize) -> Vec<[f64; 2]> {
        let TableShape { columns, rows } = self.grid;
        let coordinate = |node: usize| node as f64 / (side - 1) as f64;
        let row_of = |values: &[f32], row: usize, share: f64| -> Vec<f64> {
            let columns = (0..columns).map(|column| column + row * columns);
            let mixed =
                columns.map(|low| mix(at(values, low), at(values, low + self.grid.columns), share));
            mixed.collect()
        };
        let below: Vec<f64> = (0..rows).map(|row| at(&self.marginal, row)).collect();
        let wholes: Vec<f64> = (0..rows)
            .map(|row| at(&self.conditional, (row + 1) * columns - 1))
            .collect();
        let mut points = Vec::with_capacity(side * side);
        for y in (0..side).map(coordinate) {
            let (row, share) = place_of(y, &below, &wholes);
            let integral = row_of(&self.conditional, row, share);
            let density = row_of(&self.density, row, share);
            let whole = integral.last().copied().unwrap_or(0.0);
            let v = (row as f64 + share) / (rows - 1) as f64;
            points.extend((0..side).map(coordinate).map(|x| {
                let (column, share) = place_of(x * whole, &integral, &density);
                [(column as f64 + share) / (columns - 1) as f64, v]
            }));
        }
        points
    }
}

/// Where the integral of what is linear between `values` reaches `area`, and is `integrals` up to each
/// value: index of the value before, and the share of the way to the next one.
fn place_of(area: f64, integrals: &[f64], values: &[f64]) -> (usize, f64) {
    let after = integrals.partition_point(|integral| *integral <= area);
    let low = after.saturating_sub(1).min(integrals.len() - 2);
    let (left, right) = (values[low], values[low + 1]);
    let rest = (area - integrals[low]).max(0.0);
    // left s + (right - left) s^2 / 2 = rest, solved so that equal values divide nothing by 0.
    let root = (left * left + 2.0 * (right - left) * rest).max(0.0).sqrt();
    let share = if left + root > 0.0 {
        2.0 * rest / (left + root)
    } else {
        0.0
    };
    (low, share.min(1.0))
}

/// The mean, from a node to `share` of the way to the next, of what is linear between them.
#[inline(always)]
fn trapezoid<S: Scalar>(left: S, right: S, share: S) -> S {
    left + S::constant(0.5) * share * (right - left)
}

/// Integrals of what is linear between values one apart, up to each value.
fn cumulate(values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    let mut sum = 0.0;
    let mut before = None;
    values.map(move |value| {
        sum += before.map_or(0.0, |before| 0.5 * (before + value));
        before = Some(value);
        sum
    })
}

/// The last of such integrals.
fn whole(integrals: impl Iterator<Item = f64>) -> f64 {
    integrals.last().unwrap_or(0.0)
}
