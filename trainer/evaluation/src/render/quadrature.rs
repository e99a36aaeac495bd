//! Quadrature over incoming directions at a point of the sphere.
//!
//! A BRDF may vary quickly with the half vector, while the environment is smooth. Therefore the nodes are distributed
//! over half vectors: on rings of theta_h = 90 deg t^3, with t at the midpoints of equal steps. With 56 rings, 12 of
//! them lie within one degree of a mirror's peak. At 45 degrees, rings are 3 degrees apart, as are the nodes along each
//! ring. The incoming direction is the reflection of the outgoing one about the half vector, so
//! d omega_i = 4 (w_o . h) d omega_h.

use std::f32::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::HalfDifference;

/// Number of rings for renderings; see the convergence tests in `tests`.
pub(super) const RINGS: usize = 56;
/// Distance between nodes along a ring, in degrees, times the number of rings.
const SPACING_TIMES_RINGS: f32 = 170.0;
/// Number of rings divided by the number of nodes on the innermost ring.
const RINGS_PER_INNER_NODE: f32 = 5.0;

/// A half vector of the quadrature rule.
#[derive(Clone, Copy, Debug)]
struct HalfVector {
    sin_theta: f32,
    cos_theta: f32,
    sin_phi: f32,
    cos_phi: f32,
    /// Solid angle in sr.
    solid_angle: f32,
}

/// The half vectors of the whole upper hemisphere.
#[derive(Debug)]
pub(super) struct HalfVectors(Vec<HalfVector>);

/// The quadrature nodes for one outgoing direction, as parallel lists.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// Coordinates for the evaluation of the BRDF.
    pub(super) at: Vec<HalfDifference<f32>>,
    /// Direction towards the light in the frame of the surface: z is the normal, and the outgoing
    /// direction lies in the xz plane with x >= 0.
    pub(super) incoming: Vec<[f32; 3]>,
    /// cos(theta_i) times solid angle in sr.
    pub(super) weight: Vec<f32>,
}

impl HalfVectors {
    /// Creates a rule of `rings` rings.
    pub(super) fn new(rings: usize) -> Self {
        let step = 1.0 / rings as f32;
        let spacing = SPACING_TIMES_RINGS.to_radians() * step;
        let min_nodes = rings as f32 / RINGS_PER_INNER_NODE;
        let half_vectors = (0..rings).flat_map(move |ring| {
            let t = (ring as f32 + 0.5) * step;
            let (sin_theta, cos_theta) = (FRAC_PI_2 * t * t * t).sin_cos();
            // The midpoint rule in t; it converges faster than the exact area between two rings.
            let thickness = 3.0 * FRAC_PI_2 * t * t * step;
            let node_count = (TAU * sin_theta / spacing).max(min_nodes).ceil();
            let solid_angle = sin_theta * thickness * TAU / node_count;
            // Every other ring is rotated by half a step, so that nodes of neighboring rings do not line up.
            let offset = if ring % 2 == 0 { 0.25 } else { 0.75 };
            (0..node_count as usize).map(move |node| {
                let phi = TAU * (node as f32 + offset) / node_count;
                let (sin_phi, cos_phi) = phi.sin_cos();
                HalfVector {
                    sin_theta,
                    cos_theta,
                    sin_phi,
                    cos_phi,
                    solid_angle,
                }
            })
        });
        Self(half_vectors.collect())
    }

    /// Replaces `nodes` by those of the outgoing direction (sin theta_o, 0, cos theta_o).
    pub(super) fn nodes(&self, sin_theta_o: f32, cos_theta_o: f32, nodes: &mut Nodes) {
        nodes.at.clear();
        nodes.incoming.clear();
        nodes.weight.clear();
        for half in &self.0 {
            let x = half.sin_theta * half.cos_phi;
            let y = half.sin_theta * half.sin_phi;
            let cos_theta_d = sin_theta_o * x + cos_theta_o * half.cos_theta;
            let reflected = 2.0 * cos_theta_d;
            let cos_theta_i = reflected * half.cos_theta - cos_theta_o;
            if cos_theta_d <= 0.0 || cos_theta_i <= 0.0 {
                continue;
            }
            nodes.at.push(HalfDifference {
                hx: half.sin_theta,
                hz: half.cos_theta,
                // In the frame of the half vector, incoming and outgoing are opposite in x and y.
                dx: cos_theta_o * half.sin_theta - sin_theta_o * half.cos_phi * half.cos_theta,
                dy: sin_theta_o * half.sin_phi,
                dz: cos_theta_d,
            });
            nodes
                .incoming
                .push([reflected * x - sin_theta_o, reflected * y, cos_theta_i]);
            nodes
                .weight
                .push(cos_theta_i * 4.0 * cos_theta_d * half.solid_angle);
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Directions;

    use super::*;

    #[test]
    fn nodes_are_valid_pairs_of_directions() {
        let half_vectors = HalfVectors::new(24);
        let mut nodes = Nodes::default();
        for degrees in [0.0_f32, 10.0, 45.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            half_vectors.nodes(sin, cos, &mut nodes);
            assert!(nodes.at.len() > 200);
            for (at, incoming) in nodes.at.iter().zip(&nodes.incoming) {
                let directions = Directions {
                    incoming: *incoming,
                    outgoing: [sin, 0.0, cos],
                };
                let expected = HalfDifference::from_directions(&directions).unwrap();
                assert!(at.is_valid());
                // Here phi_d depends on rounding, and `from_directions` sets it to 0.
                if at.hx < 3e-4 {
                    assert!(expected.hx == 0.0 && (at.dz - expected.dz).abs() < 1e-6);
                    continue;
                }
                for (actual, expected) in at.to_array().into_iter().zip(expected.to_array()) {
                    // The round trip is ill-conditioned where the directions are nearly opposite,
                    // and its azimuth where the half vector is nearly the normal.
                    let tolerance = 1e-6 / at.dz.min(0.1) + 1e-7 / at.hx;
                    assert!((actual - expected).abs() < tolerance, "{at:?}: {expected}");
                }
            }
        }
    }
}
