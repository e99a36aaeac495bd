//! Radiance from every direction, in a table that is quick to look up.

use std::array;

/// Cells along one side of the table: the whole sphere in cells of 0.4 to 1.2 degrees.
const CELLS: usize = LAST_CELL as usize + 1;
/// The last of them.
const LAST_CELL: u8 = 255;
/// Nodes along one side.
const NODES: usize = CELLS + 1;

/// Light from infinitely far away: radiance in linear RGB as a function of direction.
///
/// Directions are unit vectors in the picture's frame: x to the right, y up, z towards the viewer.
/// Radiance is relative; [exposure](super::Image::tone_map) is chosen for the built-in
/// [`studio`](Environment::studio).
///
/// The sphere of directions is unfolded into a square (its octahedral map) and interpolated
/// bilinearly between 257 x 257 nodes. Opposite halves of the square's border hold the same
/// directions, so there is no seam.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Row by row; the fourth number pads each node to one SIMD register.
    nodes: Vec<[[f32; 4]; NODES]>,
}

impl Environment {
    /// Tabulates a radiance. Features narrower than about three degrees are lost.
    #[must_use]
    pub fn from_fn(radiance: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let coordinate = |index: usize| 2.0 * index as f32 / CELLS as f32 - 1.0;
        let node = |column, row| {
            let [r, g, b] = radiance(fold([coordinate(column), coordinate(row)]));
            [r, g, b, 0.0]
        };
        let nodes = (0..NODES)
            .map(|row| array::from_fn(|column| node(column, row)))
            .collect();
        Self { nodes }
    }

    /// The same radiance from everywhere.
    #[must_use]
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self::from_fn(|_| radiance)
    }

    /// The radiance arriving from a unit direction.
    #[must_use]
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let [r, g, b, _] = self.padded(direction);
        [r, g, b]
    }

    /// The same, still padded.
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
}

/// The cell of a coordinate, of which `as` makes a number in any case: it saturates, and a NaN
/// becomes 0. (Through i32, because that takes one instruction.)
#[inline(always)]
fn cell(coordinate: f32) -> u8 {
    (coordinate as i32).clamp(0, LAST_CELL.into()) as u8
}

/// `from` at 0, `to` at 1.
#[inline(always)]
fn between(from: [f32; 4], to: [f32; 4], t: f32) -> [f32; 4] {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit directions all over the sphere, poles and equator included.
    fn directions() -> impl Iterator<Item = [f32; 3]> {
        (0..=36).flat_map(|polar| {
            (0..72).map(move |azimuth| {
                let (sin, cos) = (polar as f32 * 5.0).to_radians().sin_cos();
                let (y, x) = (azimuth as f32 * 5.0).to_radians().sin_cos();
                [sin * x, sin * y, cos]
            })
        })
    }

    #[test]
    fn a_table_follows_its_function_without_seams() {
        let smooth = |[x, y, z]: [f32; 3]| [1.0 + x, 2.0 + y * z, (3.0 * z).exp()];
        let environment = Environment::from_fn(smooth);
        for direction in directions() {
            for (looked_up, exact) in environment
                .radiance(direction)
                .iter()
                .zip(smooth(direction))
            {
                assert!(
                    (looked_up - exact).abs() < 2e-3 * exact.max(1.0),
                    "{direction:?}: {looked_up} instead of {exact}"
                );
            }
        }
    }

    #[test]
    fn directions_that_are_none_do_no_harm() {
        let environment = Environment::constant([1.0, 2.0, 3.0]);
        for direction in [[0.0; 3], [f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]] {
            let _ = environment.radiance(direction);
        }
        assert_eq!(environment.radiance([0.0, 0.0, -1.0]), [1.0, 2.0, 3.0]);
    }
}
