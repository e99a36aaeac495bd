//! Which directions to integrate over, seen from one point of the sphere.
//!
//! A BRDF is narrow in its half vector and the environment is smooth, so the nodes are laid out
//! over half vectors: on rings of theta_h = 90 deg t^3, with t at the midpoints of equal steps.
//! With 56 rings, 12 of them lie within one degree of a mirror's peak; at 45 degrees they are 3
//! degrees apart, as are the nodes along each ring. The incoming direction is the mirror image of
//! the outgoing one at the half vector, d omega_i = 4 (w_o . h) d omega_h.

use std::f32::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::HalfDifference;

/// Rings of the rule that pictures are rendered with; see the convergence test of `sphere`.
pub(super) const RINGS: usize = 56;
/// Distance between the nodes along a ring, in degrees, times the number of rings.
const SPACING: f32 = 170.0;
/// Rings for each node on the innermost ring.
const RINGS_A_NODE: f32 = 5.0;

/// A half vector of the rule.
#[derive(Clone, Copy, Debug)]
struct HalfVector {
    sin_theta: f32,
    cos_theta: f32,
    sin_phi: f32,
    cos_phi: f32,
    /// Solid angle in sr.
    solid_angle: f32,
    /// Angle to the neighbors, along the ring or to the next one, in radians.
    spacing: f32,
}

/// The half vectors of the whole upper hemisphere.
#[derive(Debug)]
pub(super) struct HalfVectors(Vec<HalfVector>);

/// What one outgoing direction is integrated over; the lists run in parallel.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// Where the BRDF is to be evaluated.
    pub(super) at: Vec<HalfDifference<f32>>,
    /// Direction towards the light in the frame of the surface: z is the normal, and the outgoing
    /// direction lies in the xz plane with x >= 0.
    pub(super) incoming: Vec<[f32; 3]>,
    /// cos(theta_i) times solid angle in sr.
    pub(super) weight: Vec<f32>,
    /// About the angle between incoming directions of neighbors, in radians.
    pub(super) spacing: Vec<f32>,
}

impl HalfVectors {
    /// The rule with so many rings. If it is to be `even`, for environments with small bright
    /// sources, the nodes along a ring are no farther apart than it is from the next ring.
    pub(super) fn new(rings: usize, even: bool) -> Self {
        let step = 1.0 / rings as f32;
        let spacing = SPACING.to_radians() * step;
        let fewest = rings as f32 / RINGS_A_NODE;
        let half_vectors = (0..rings).flat_map(move |ring| {
            let t = (ring as f32 + 0.5) * step;
            let (sin_theta, cos_theta) = (FRAC_PI_2 * t * t * t).sin_cos();
            // Not the exact area between two rings: the midpoint rule in t converges faster.
            let thickness = 3.0 * FRAC_PI_2 * t * t * step;
            let apart = if even {
                spacing.min(thickness)
            } else {
                spacing
            };
            let around = (TAU * sin_theta / apart).max(fewest).ceil();
            let solid_angle = sin_theta * thickness * TAU / around;
            let neighbor = TAU * sin_theta / around;
            // Every other ring is turned by half a step, lest nodes line up.
            let offset = if ring % 2 == 0 { 0.25 } else { 0.75 };
            (0..around as usize).map(move |node| {
                let phi = TAU * (node as f32 + offset) / around;
                let (sin_phi, cos_phi) = phi.sin_cos();
                HalfVector {
                    sin_theta,
                    cos_theta,
                    sin_phi,
                    cos_phi,
                    solid_angle,
                    spacing: neighbor.max(thickness),
                }
            })
        });
        Self(half_vectors.collect())
    }

    /// The nodes for the outgoing direction (sin, 0, cos) of theta_o, instead of what is in
    /// `nodes`.
    pub(super) fn nodes(&self, sin_theta_o: f32, cos_theta_o: f32, nodes: &mut Nodes) {
        nodes.at.clear();
        nodes.incoming.clear();
        nodes.weight.clear();
        nodes.spacing.clear();
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
            // The mirror image turns twice as far as the mirror.
            nodes.spacing.push(2.0 * half.spacing);
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::Directions;

    use super::*;

    #[test]
    fn nodes_are_pairs_of_directions_above_the_horizon() {
        let half_vectors = HalfVectors::new(24, false);
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
                // There phi_d is a matter of rounding, and `from_directions` takes it for 0.
                if at.hx < 3e-4 {
                    assert!(expected.hx == 0.0 && (at.dz - expected.dz).abs() < 1e-6);
                    continue;
                }
                for (here, there) in [
                    (at.hx, expected.hx),
                    (at.hz, expected.hz),
                    (at.dx, expected.dx),
                    (at.dy, expected.dy),
                    (at.dz, expected.dz),
                ] {
                    // The round trip is ill-conditioned where the directions are nearly opposite,
                    // and its azimuth where the half vector is nearly the normal.
                    let tolerance = 1e-6 / at.dz.min(0.1) + 1e-7 / at.hx;
                    assert!((here - there).abs() < tolerance, "{at:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn projected_solid_angle_of_the_hemisphere_is_pi() {
        let mut nodes = Nodes::default();
        for (degrees, even) in (0..90_u8).flat_map(|degrees| [(degrees, false), (degrees, true)]) {
            let half_vectors = HalfVectors::new(RINGS, even);
            let (sin, cos) = f32::from(degrees).to_radians().sin_cos();
            half_vectors.nodes(sin, cos, &mut nodes);
            let sum: f64 = nodes.weight.iter().map(|w| f64::from(*w)).sum();
            let error = sum / std::f64::consts::PI - 1.0;
            assert!(
                error.abs() < 1.5e-3,
                "theta_o = {degrees} degrees: {error:e}"
            );
        }
    }
}
