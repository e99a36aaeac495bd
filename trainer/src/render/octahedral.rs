//! The octahedral map: radiance tables and light grids over a square that covers the sphere of directions.

use std::array;

/// Cells along a side of a table. A cell is 0.4 to 1.2 degrees wide.
pub(super) const CELLS: usize = LAST_CELL as usize + 1;
/// Index of the last cell.
const LAST_CELL: u8 = 255;
/// Nodes along a side.
const NODES: usize = CELLS + 1;

/// A table of radiance in linear RGB at 257 x 257 nodes, with bilinear interpolation.
///
/// Nodes on opposite halves of each edge of the square have the same direction, so the table has no seam.
#[derive(Clone, Debug)]
pub(super) struct RadianceTable {
    /// Nodes row by row; the fourth number pads each node to a SIMD register.
    nodes: Vec<[[f32; 4]; NODES]>,
}

impl RadianceTable {
    /// Tabulates radiance as a function of a unit direction.
    pub(super) fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self::at_nodes(|column, row| {
            let [r, g, b] = radiance(direction(column, row));
            [r, g, b, 0.0]
        })
    }

    /// Tabulates padded radiance as a function of column and row.
    fn at_nodes(node: impl Fn(usize, usize) -> [f32; 4]) -> Self {
        let nodes = (0..NODES)
            .map(|row| array::from_fn(|column| node(column, row)))
            .collect();
        Self { nodes }
    }

    /// Returns the radiance from a unit direction, padded by a 0.
    #[inline(always)]
    pub(super) fn radiance_padded(&self, direction: [f32; 3]) -> [f32; 4] {
        let [u, v] = to_square(direction).map(|c| (c + 1.0) * (0.5 * CELLS as f32));
        let (column, row) = (cell(u), cell(v));
        let within = [u - column as f32, v - row as f32];
        let node = |column: usize, row: usize| self.nodes[row][column];
        bilinear(node, [column.into(), row.into()], within)
    }

    /// Multiplies all radiance by a factor.
    pub(super) fn scale(&mut self, factor: f32) {
        for channel in self.nodes.as_flattened_mut().as_flattened_mut() {
            *channel *= factor;
        }
    }

    /// Integrates radiance times a weight, a function of direction, over the sphere.
    pub(super) fn integral(&self, weight: impl Fn([f32; 3]) -> f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        // The trapezoidal rule; at a point p of the octahedron, d omega = du dv / |p|^3.
        let edge_weight = |index| if index % CELLS == 0 { 0.5 } else { 1.0 };
        let area = (2.0 / CELLS as f64).powi(2);
        for (row, nodes) in self.nodes.iter().enumerate() {
            for (column, radiance) in nodes.iter().enumerate() {
                let direction = direction(column, row);
                // On the octahedron |x| + |y| + |z| = 1, so 1 / |p| is |x| + |y| + |z| of the unit vector p / |p|.
                let inverse_length: f32 = direction.iter().map(|c| c.abs()).sum();
                let solid_angle = f64::from(inverse_length).powi(3)
                    * area
                    * edge_weight(row)
                    * edge_weight(column);
                let weight = weight(direction) * solid_angle;
                for (sum, channel) in sum.iter_mut().zip(radiance) {
                    *sum += weight * f64::from(*channel);
                }
            }
        }
        sum
    }
}

/// Returns the unit direction of a node.
fn direction(column: usize, row: usize) -> [f32; 3] {
    from_square([column, row].map(|index| 2.0 * index as f32 / CELLS as f32 - 1.0))
}

/// A grid over the square that accumulates light. Each contribution is distributed over the four nearest nodes with
/// the weights of bilinear interpolation, so that the total is conserved for sources of any size.
#[derive(Clone, Debug)]
pub(super) struct LightGrid {
    cells: usize,
    /// Sums of (cells + 1)^2 nodes: radiance times solid angle for each channel, and solid angle.
    sums: Vec<[f64; 4]>,
}

impl LightGrid {
    /// Creates a grid without light.
    pub(super) fn new(cells: usize) -> Self {
        Self {
            cells,
            sums: vec![[0.0; 4]; (cells + 1) * (cells + 1)],
        }
    }

    /// Adds the light from a unit direction: radiance times solid angle, and solid angle in sr.
    pub(super) fn add(&mut self, direction: [f32; 3], light: [f64; 4]) {
        let [u, v] = to_square(direction).map(|c| f64::from(c + 1.0) * 0.5 * self.cells as f64);
        self.splat([u, v], light);
    }

    /// Adds light at a position on the square, in units of cells.
    fn splat(&mut self, position: [f64; 2], light: [f64; 4]) {
        let first = position.map(|c| (c as usize).min(self.cells - 1));
        let [right, down] = [0, 1].map(|axis| position[axis] - first[axis] as f64);
        for (row, vertical) in [(0, 1.0 - down), (1, down)] {
            for (column, horizontal) in [(0, 1.0 - right), (1, right)] {
                let index = (first[1] + row) * (self.cells + 1) + first[0] + column;
                for (sum, light) in self.sums[index].iter_mut().zip(light) {
                    *sum += horizontal * vertical * light;
                }
            }
        }
    }

    /// Returns a grid with the same light and half the number of cells along a side.
    pub(super) fn coarser(&self) -> Self {
        let mut coarser = Self::new(self.cells / 2);
        for (row, nodes) in self.sums.chunks_exact(self.cells + 1).enumerate() {
            for (column, light) in nodes.iter().enumerate() {
                coarser.splat([column, row].map(|index| 0.5 * index as f64), *light);
            }
        }
        coarser
    }

    /// Returns a table of the mean radiance around each node.
    pub(super) fn to_table(&self) -> RadianceTable {
        let side = self.cells + 1;
        // A node on an edge has the same direction as its mirror image about the middle of that edge. All four corners
        // have the same direction.
        let same_direction = |index: usize, on_edge: bool| {
            let mirrored = self.cells - index;
            match on_edge {
                true => vec![index.min(mirrored), index.max(mirrored)],
                false => vec![index],
            }
        };
        let is_end = |index: usize| [0, self.cells].contains(&index);
        let mean_at = |column: usize, row: usize| {
            let rows = same_direction(row, is_end(column));
            let mut sums = [0.0; 4];
            for column in same_direction(column, is_end(row)) {
                for row in &rows {
                    for (sum, value) in sums.iter_mut().zip(self.sums[row * side + column]) {
                        *sum += value;
                    }
                }
            }
            let [r, g, b, solid_angle] = sums;
            let [r, g, b] = [r, g, b].map(|channel| (channel / solid_angle) as f32);
            [r, g, b, 0.0]
        };
        let means: Vec<[f32; 4]> = (0..side * side)
            .map(|index| mean_at(index % side, index / side))
            .collect();
        let scale = self.cells as f32 / CELLS as f32;
        RadianceTable::at_nodes(|column, row| {
            let position = [column, row].map(|index| index as f32 * scale);
            let first = position.map(|c| (c as usize).min(self.cells - 1));
            let within = [0, 1].map(|axis| position[axis] - first[axis] as f32);
            bilinear(|column, row| means[row * side + column], first, within)
        })
    }
}

/// Interpolates bilinearly in the cell whose upper left node has this column and row. `right` and `down` are the position
/// within the cell, in \[0, 1\].
#[inline(always)]
fn bilinear(
    node: impl Fn(usize, usize) -> [f32; 4],
    [column, row]: [usize; 2],
    [right, down]: [f32; 2],
) -> [f32; 4] {
    let top = lerp(node(column, row), node(column + 1, row), right);
    let bottom = lerp(node(column, row + 1), node(column + 1, row + 1), right);
    lerp(top, bottom, down)
}

/// Returns the cell of a coordinate. `as` saturates and converts NaN to 0. Conversion to i32 takes one
/// instruction.
#[inline(always)]
fn cell(coordinate: f32) -> u8 {
    (coordinate as i32).clamp(0, LAST_CELL.into()) as u8
}

/// Interpolates linearly: `from` at t = 0, `to` at t = 1.
#[inline(always)]
pub(super) fn lerp(from: [f32; 4], to: [f32; 4], t: f32) -> [f32; 4] {
    array::from_fn(|channel| from[channel] + t * (to[channel] - from[channel]))
}

/// Maps a direction to the square \[-1, 1\]^2: projects it on the octahedron |x| + |y| + |z| = 1, and folds the lower
/// half outwards.
#[inline(always)]
fn to_square([x, y, z]: [f32; 3]) -> [f32; 2] {
    let scale = 1.0 / (x.abs() + y.abs() + z.abs());
    let (u, v) = (x * scale, y * scale);
    if z >= 0.0 {
        [u, v]
    } else {
        [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)]
    }
}

/// Maps the square to unit directions; the inverse of [`to_square`].
fn from_square([u, v]: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z >= 0.0 {
        (u, v)
    } else {
        ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
    };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}
