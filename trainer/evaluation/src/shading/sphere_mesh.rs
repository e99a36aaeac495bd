//! A unit sphere as a strip of triangles.

use std::f32::consts::{PI, TAU};

/// The number of rings of triangles.
const RINGS: u16 = 24;
/// The number of vertices around the axis, a multiple of 4.
const SECTORS: u16 = 48;

/// Returns the vertices of a strip that runs around the axis, ring by ring. They equal their normals.
pub(super) fn sphere_strip() -> Vec<[f32; 3]> {
    let vertex = |ring: u16, sector: u16| {
        let (sine, y) = (PI * f32::from(ring) / f32::from(RINGS)).sin_cos();
        let (z, x) = (TAU * f32::from(sector % SECTORS) / f32::from(SECTORS)).sin_cos();
        [sine * x, y, -sine * z]
    };
    let columns = (0..RINGS).flat_map(|ring| (0..=SECTORS).map(move |sector| (ring, sector)));
    columns
        .flat_map(|(ring, sector)| [vertex(ring, sector), vertex(ring + 1, sector)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The signed volume of the tetrahedra to the center is almost that of a ball.
    #[test]
    fn strip_is_closed_and_faces_outward() {
        let vertices = sphere_strip();
        let triangles = vertices.windows(3).enumerate().map(|(index, corners)| {
            let (a, b, c) = (corners[0], corners[1 + index % 2], corners[2 - index % 2]);
            let cross = [
                b[1] * c[2] - b[2] * c[1],
                b[2] * c[0] - b[0] * c[2],
                b[0] * c[1] - b[1] * c[0],
            ];
            let products = a.iter().zip(cross).map(|(a, cross)| a * cross);
            products.sum::<f32>() / 6.0
        });
        let volumes: Vec<f32> = triangles.collect();
        assert!(volumes.iter().all(|volume| *volume > -1e-9));
        let volume: f32 = volumes.iter().sum();
        assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 0.02, "{volume}");
        for vertex in &vertices {
            let square: f32 = vertex.iter().map(|x| x * x).sum();
            assert!((square - 1.0).abs() < 1e-6, "{vertex:?}");
        }
        // The bounds that the file states.
        for axis in 0..3 {
            let of_axis = || vertices.iter().map(|vertex| vertex[axis]);
            let bounds = (of_axis().fold(0.0, f32::min), of_axis().fold(0.0, f32::max));
            assert_eq!(bounds, (-1.0, 1.0));
        }
    }
}
