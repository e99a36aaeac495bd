//! Environment lighting, tabulated for fast lookup.

use std::array;

/// Cells along a side of the table. A cell is 0.4 to 1.2 degrees wide.
const CELLS: usize = LAST_CELL as usize + 1;
/// Index of the last cell.
const LAST_CELL: u8 = 255;
/// Nodes along a side.
const NODES: usize = CELLS + 1;

/// An environment map: radiance in linear RGB as a function of direction, from infinitely far away.
///
/// Directions are unit vectors in the picture's frame: x to the right, y up, z towards the viewer.
///
/// The octahedral map unfolds the sphere of directions into a square. Radiance is tabulated at 257 x 257 nodes of
/// the square and interpolated bilinearly. Nodes on opposite halves of each edge of the square have the same direction,
/// so the table has no seam.
pub(super) struct Environment {
    /// Nodes row by row; the fourth number pads each node to a SIMD register.
    nodes: Vec<[[f32; 4]; NODES]>,
}

impl Environment {
    /// Tabulates a function of a unit direction. Features narrower than about three degrees are lost.
    pub(super) fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let node = |column, row| {
            let [r, g, b] = radiance(direction(column, row));
            [r, g, b, 0.0]
        };
        let nodes = (0..NODES)
            .map(|row| array::from_fn(|column| node(column, row)))
            .collect();
        Self { nodes }
    }

    /// Returns the radiance from a unit direction, padded by a 0.
    #[inline(always)]
    pub(super) fn radiance(&self, direction: [f32; 3]) -> [f32; 4] {
        let [u, v] = to_square(direction).map(|c| (c + 1.0) * (0.5 * CELLS as f32));
        let (column, row) = (cell(u), cell(v));
        let within = [u - column as f32, v - row as f32];
        let node = |column: usize, row: usize| self.nodes[row][column];
        bilinear(node, [column.into(), row.into()], within)
    }
}

/// Returns the unit direction of a node.
fn direction(column: usize, row: usize) -> [f32; 3] {
    from_square([column, row].map(|index| 2.0 * index as f32 / CELLS as f32 - 1.0))
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
pub(super) fn lerp<const N: usize>(from: [f32; N], to: [f32; N], t: f32) -> [f32; N] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_approximates_function_without_seams() {
        let smooth = |[x, y, z]: [f32; 3]| [1.0 + x, 2.0 + y * z, (3.0 * z).exp()];
        let environment = Environment::from_fn(smooth);
        // Directions on the whole sphere, including poles and equator.
        for (polar, azimuth) in
            (0..=36).flat_map(|polar| (0..72).map(move |azimuth| (polar, azimuth)))
        {
            let (sin, cos) = (polar as f32 * 5.0).to_radians().sin_cos();
            let (y, x) = (azimuth as f32 * 5.0).to_radians().sin_cos();
            let direction = [sin * x, sin * y, cos];
            let tabulated = environment.radiance(direction);
            for (tabulated, exact) in tabulated.iter().zip(smooth(direction)) {
                assert!(
                    (tabulated - exact).abs() < 2e-3 * exact.max(1.0),
                    "{direction:?}: {tabulated} instead of {exact}"
                );
            }
        }
    }
}
