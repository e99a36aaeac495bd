//! A unit sphere as triangles.

use std::f32::consts::{PI, TAU};

/// The number of rings of triangles, and of vertices around the axis.
const RINGS: u16 = 24;
const SECTORS: u16 = 48;

/// A unit sphere: its normals equal its positions.
pub(super) struct SphereMesh {
    pub(super) vertices: Vec<[f32; 3]>,
    /// Three for each triangle, counterclockwise as seen from outside.
    pub(super) indices: Vec<u16>,
}

impl SphereMesh {
    pub(super) fn new() -> Self {
        let row = SECTORS + 1;
        let mut vertices = Vec::new();
        for ring in 0..=RINGS {
            for sector in 0..row {
                let (sine, y) = match ring {
                    0 => (0.0, 1.0),
                    RINGS => (0.0, -1.0),
                    _ => (PI * f32::from(ring) / f32::from(RINGS)).sin_cos(),
                };
                // Exactly 1 and -1 at the quarters: the bounds of an accessor must be exact.
                let (x, z) = match 4 * (sector % SECTORS) / SECTORS {
                    quarter if sector % (SECTORS / 4) == 0 => {
                        [(1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0)][usize::from(quarter)]
                    }
                    _ => {
                        let phi = TAU * f32::from(sector) / f32::from(SECTORS);
                        (phi.cos(), -phi.sin())
                    }
                };
                let sine = if 2 * ring == RINGS { 1.0 } else { sine };
                let y = if 2 * ring == RINGS { 0.0 } else { y };
                vertices.push([sine * x, y, sine * z]);
            }
        }
        let mut indices = Vec::new();
        for ring in 0..RINGS {
            for sector in 0..SECTORS {
                let corner = ring * row + sector;
                let [above, below] = [corner, corner + row];
                if ring > 0 {
                    indices.extend([above, below, above + 1]);
                }
                if ring < RINGS - 1 {
                    indices.extend([above + 1, below, below + 1]);
                }
            }
        }
        Self { vertices, indices }
    }

    pub(super) fn vertex_bytes(&self) -> Vec<u8> {
        let numbers = self.vertices.as_flattened().iter();
        numbers.flat_map(|number| number.to_le_bytes()).collect()
    }

    pub(super) fn index_bytes(&self) -> Vec<u8> {
        let indices = self.indices.iter();
        indices.flat_map(|index| index.to_le_bytes()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The signed volume of the tetrahedra to the center is almost that of a ball.
    #[test]
    fn triangles_are_closed_and_point_outward() {
        let mesh = SphereMesh::new();
        let triangles = mesh.indices.as_chunks::<3>().0.iter();
        let volume: f32 = triangles
            .map(|corners| {
                let [a, b, c] = corners.map(|index| mesh.vertices[usize::from(index)]);
                let cross = [
                    b[1] * c[2] - b[2] * c[1],
                    b[2] * c[0] - b[0] * c[2],
                    b[0] * c[1] - b[1] * c[0],
                ];
                let products = a.iter().zip(cross).map(|(a, cross)| a * cross);
                let volume = products.sum::<f32>() / 6.0;
                assert!(volume > 0.0, "{corners:?}");
                volume
            })
            .sum();
        assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 0.02, "{volume}");
        for vertex in &mesh.vertices {
            let square: f32 = vertex.iter().map(|x| x * x).sum();
            assert!((square - 1.0).abs() < 1e-6, "{vertex:?}");
        }
    }
}
