//! A single material as a basis whose components are its color channels. `glimpse_core` evaluates this basis
//! like a fit of the model Linear, and does not need the material.

use std::f64::consts::{PI, TAU};

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::{Nodes, map};
use glimpse_materials::Material;
use rayon::prelude::*;

use super::compact::{HOST_NODES, angles_at, pack};

/// The coefficients of red, green and blue that reproduce the material.
pub const CHANNEL_COEFFICIENTS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// The nodes: a third of those of a basis on the host suffice for display.
const NODES: Nodes = Nodes {
    phi_d: 8,
    ..HOST_NODES
};

/// Returns a material as the file of a basis with three components, in 302 kB, for [`CHANNEL_COEFFICIENTS`].
///
/// The material is averaged over its mirror image and over exchange of light and sensor, because a basis has these
/// symmetries. Non-finite values are replaced by 0.
#[must_use]
pub fn material_basis(material: &dyn Material) -> Vec<u8> {
    let values: Vec<[f64; 3]> = (0..NODES.count().unwrap_or_default())
        .into_par_iter()
        .map(|node| mapped_brdf(material, angles_at(NODES, node)))
        .collect();
    // The center of the range of channels, which minimizes the largest component.
    let center = |value: &[f64; 3]| {
        let [red, green, blue] = *value;
        0.5 * (red.min(green).min(blue) + red.max(green).max(blue))
    };
    let means = values.iter().map(center).collect();
    let channel = |index: usize| {
        let values = values.iter();
        values.map(|value| value[index] - center(value)).collect()
    };
    pack(0, NODES, &[means, channel(0), channel(1), channel(2)])
}

/// Returns ln(1 + f w / e) of each channel, averaged over the directions that are equivalent by symmetry.
fn mapped_brdf(material: &dyn Material, angles: Angles<f64>) -> [f64; 3] {
    let cosines = {
        let across = angles.theta_h.sin() * angles.theta_d.sin() * angles.phi_d.cos();
        let along = angles.theta_h.cos() * angles.theta_d.cos();
        [along - across, along + across]
    };
    let weight = cosines[0].max(0.0) * cosines[1].max(0.0);
    let mut sum = [0.0; 3];
    for phi_d in [
        angles.phi_d,
        TAU - angles.phi_d,
        PI - angles.phi_d,
        PI + angles.phi_d,
    ] {
        let angles = Angles { phi_d, ..angles };
        let brdf = material.at_angles(angles.map(|angle| angle as f32));
        for (sum, value) in sum.iter_mut().zip(brdf) {
            let value = if value.is_finite() {
                value.max(0.0)
            } else {
                0.0
            };
            *sum += 0.25 * map(f64::from(value), weight);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::HalfDifference;
    use glimpse_core::model::linear::Basis;

    use super::*;
    use glimpse_materials::Procedural;

    /// At a node, core's interpolation has the weight 1 there.
    #[test]
    fn node_angles_match_core_interpolation() {
        for node in 0..HOST_NODES.count().expect("few nodes") {
            let direction =
                HalfDifference::from_angles(angles_at(HOST_NODES, node).map(|a| a as f32));
            let corners = HOST_NODES.corners(&direction);
            let own = corners.iter().filter(|corner| corner.node == node);
            let share: f32 = own.map(|corner| corner.weight).sum();
            // Light or sensor at the horizon, and nodes at which phi_d has no effect.
            let is_singular = direction.cos_theta_i().min(direction.cos_theta_o()) < 1e-4
                || direction.hx < 1e-3
                || direction.dx.hypot(direction.dy) < 1e-3;
            assert!(is_singular || share > 0.9, "{node}: {share}");
        }
    }

    #[test]
    fn material_basis_reproduces_material() {
        for material in Procedural::set(5, 3) {
            let bytes = material_basis(&material);
            let basis = Basis::parse(&bytes).expect("the bytes are a compact basis");
            // Over evenly spread directions: with random ones, a few near a highlight dominate.
            let tabulated = |direction: &HalfDifference<f32>| {
                basis
                    .brdf(CHANNEL_COEFFICIENTS, direction)
                    .expect("the directions are above the horizon")
            };
            let loss = glimpse_materials::loss::loss_between(&tabulated, &material);
            assert!(loss < 1.5e-3, "{}: {loss}", material.name());
        }
    }
}
