//! The sphere of directions unfolded into a square, and light gathered on a grid over it.

use std::array;

/// Cells along one side of a table: the whole sphere in cells of 0.4 to 1.2 degrees.
pub(super) const CELLS: usize = LAST_CELL as usize + 1;
/// The last of them.
const LAST_CELL: u8 = 255;
/// Nodes along one side.
const NODES: usize = CELLS + 1;

/// Radiance in linear RGB at 257 x 257 nodes, between which it is interpolated bilinearly.
///
/// Opposite halves of the square's border hold the same directions, so there is no seam.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// Row by row; the fourth number pads each node to one SIMD register.
    nodes: Vec<[[f32; 4]; NODES]>,
}

impl Table {
    /// Radiance as a function of a unit direction.
    pub(super) fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self::at_nodes(|column, row| radiance(direction(column, row)))
    }

    /// Radiance as a function of column and row.
    fn at_nodes(radiance: impl Fn(usize, usize) -> [f32; 3]) -> Self {
        let node = |column, row| {
            let [r, g, b] = radiance(column, row);
            [r, g, b, 0.0]
        };
        let nodes = (0..NODES)
            .map(|row| array::from_fn(|column| node(column, row)))
            .collect();
        Self { nodes }
    }

    /// The radiance from a unit direction, and a 0.
    #[inline(always)]
    pub(super) fn padded(&self, direction: [f32; 3]) -> [f32; 4] {
        let [u, v] = unfold(direction).map(|c| (c + 1.0) * (0.5 * CELLS as f32));
        let (column, row) = (cell(u), cell(v));
        let (right, down) = (u - column as f32, v - row as f32);
        let (column, row) = (usize::from(column), usize::from(row));
        let (upper, lower) = (&self.nodes[row], &self.nodes[row + 1]);
        let top = between(upper[column], upper[column + 1], right);
        let bottom = between(lower[column], lower[column + 1], right);
        between(top, bottom, down)
    }

    /// Multiplies all radiance.
    pub(super) fn scale(&mut self, factor: f32) {
        for channel in self.nodes.as_flattened_mut().as_flattened_mut() {
            *channel *= factor;
        }
    }

    /// The integral of radiance times a weight, a function of direction, over the sphere.
    pub(super) fn integral(&self, weight: impl Fn([f32; 3]) -> f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        // The trapezoidal rule; a point p of the octahedron stands for d omega = du dv / |p|^3.
        let share = |index| if index % CELLS == 0 { 0.5 } else { 1.0 };
        let area = (2.0 / CELLS as f64).powi(2);
        for (row, nodes) in self.nodes.iter().enumerate() {
            for (column, radiance) in nodes.iter().enumerate() {
                let direction = direction(column, row);
                // On the octahedron |x| + |y| + |z| = 1, so 1 / |p| is that sum for p / |p|.
                let inverse: f32 = direction.iter().map(|c| c.abs()).sum();
                let solid_angle = f64::from(inverse).powi(3) * area * share(row) * share(column);
                let weight = weight(direction) * solid_angle;
                for (sum, channel) in sum.iter_mut().zip(radiance) {
                    *sum += weight * f64::from(*channel);
                }
            }
        }
        sum
    }
}

/// The unit direction of a node.
fn direction(column: usize, row: usize) -> [f32; 3] {
    fold([column, row].map(|index| 2.0 * index as f32 / CELLS as f32 - 1.0))
}

/// Light gathered on a grid over the square: each bit of it is shared out among the four nodes
/// around it, in the shares of bilinear interpolation, so none is lost however small its source.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    cells: usize,
    /// (cells + 1)^2 nodes: radiance times solid angle for each channel, and solid angle.
    sums: Vec<[f64; 4]>,
}

impl Gathered {
    /// Nothing yet.
    pub(super) fn new(cells: usize) -> Self {
        Self {
            cells,
            sums: vec![[0.0; 4]; (cells + 1) * (cells + 1)],
        }
    }

    /// Adds the light from a unit direction: radiance times solid angle, and solid angle in sr.
    pub(super) fn add(&mut self, direction: [f32; 3], light: [f64; 4]) {
        let [u, v] = unfold(direction).map(|c| f64::from(c + 1.0) * 0.5 * self.cells as f64);
        self.share([u, v], light);
    }

    /// Adds light at a place measured in cells.
    fn share(&mut self, place: [f64; 2], light: [f64; 4]) {
        let first = place.map(|c| (c as usize).min(self.cells - 1));
        let [right, down] = [0, 1].map(|axis| place[axis] - first[axis] as f64);
        for (row, vertical) in [(0, 1.0 - down), (1, down)] {
            for (column, horizontal) in [(0, 1.0 - right), (1, right)] {
                let index = (first[1] + row) * (self.cells + 1) + first[0] + column;
                for (sum, light) in self.sums[index].iter_mut().zip(light) {
                    *sum += horizontal * vertical * light;
                }
            }
        }
    }

    /// The same light on a grid of half as many cells.
    pub(super) fn coarser(&self) -> Self {
        let mut coarser = Self::new(self.cells / 2);
        for (row, nodes) in self.sums.chunks_exact(self.cells + 1).enumerate() {
            for (column, light) in nodes.iter().enumerate() {
                coarser.share([column, row].map(|index| 0.5 * index as f64), *light);
            }
        }
        coarser
    }

    /// The mean radiance around each node, in a table.
    pub(super) fn to_table(&self) -> Table {
        let side = self.cells + 1;
        // Nodes of the border stand for one direction with their mirror image at the middle of
        // their edge, the four corners all for one.
        let whole = |column: usize, row: usize| {
            let (far_column, far_row) = (self.cells - column, self.cells - row);
            let at = |column, row| self.sums[row * side + column];
            let (vertical, horizontal) = (
                [0, self.cells].contains(&column),
                [0, self.cells].contains(&row),
            );
            let sum = |places: &[[f64; 4]]| {
                let channel = |index: usize| places.iter().map(|place| place[index]).sum::<f64>();
                let solid_angle = channel(3);
                [0, 1, 2].map(|index| (channel(index) / solid_angle) as f32)
            };
            match (vertical, horizontal) {
                (true, true) => sum(&[
                    at(0, 0),
                    at(0, side - 1),
                    at(side - 1, 0),
                    at(side - 1, side - 1),
                ]),
                (true, false) => sum(&[at(column, row), at(column, far_row)]),
                (false, true) => sum(&[at(column, row), at(far_column, row)]),
                (false, false) => sum(&[at(column, row)]),
            }
        };
        let means: Vec<[f32; 3]> = (0..side * side)
            .map(|index| whole(index % side, index / side))
            .collect();
        let scale = self.cells as f32 / CELLS as f32;
        Table::at_nodes(|column, row| {
            let [u, v] = [column, row].map(|index| index as f32 * scale);
            let [left, top] = [u, v].map(|c| (c as usize).min(self.cells - 1));
            let at = |column: usize, row: usize| {
                let [r, g, b] = means[row * side + column];
                [r, g, b, 0.0]
            };
            let upper = between(at(left, top), at(left + 1, top), u - left as f32);
            let lower = between(at(left, top + 1), at(left + 1, top + 1), u - left as f32);
            let [r, g, b, _] = between(upper, lower, v - top as f32);
            [r, g, b]
        })
    }
}

/// The cell of a coordinate, of which `as` makes a number in any case: it saturates, and a NaN
/// becomes 0. (Through i32, because that takes one instruction.)
#[inline(always)]
fn cell(coordinate: f32) -> u8 {
    (coordinate as i32).clamp(0, LAST_CELL.into()) as u8
}

/// `from` at 0, `to` at 1.
#[inline(always)]
pub(super) fn between(from: [f32; 4], to: [f32; 4], t: f32) -> [f32; 4] {
    array::from_fn(|channel| from[channel] + t * (to[channel] - from[channel]))
}

/// From a direction to the square \[-1, 1\]^2: projected on the octahedron |x| + |y| + |z| = 1,
/// whose lower half is then folded outwards.
#[inline(always)]
fn unfold([x, y, z]: [f32; 3]) -> [f32; 2] {
    let scale = 1.0 / (x.abs() + y.abs() + z.abs());
    let (u, v) = (x * scale, y * scale);
    if z >= 0.0 {
        [u, v]
    } else {
        [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)]
    }
}

/// The inverse of [`unfold`].
fn fold([u, v]: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z >= 0.0 {
        (u, v)
    } else {
        ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
    };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}
