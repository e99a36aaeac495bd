//! A single material as a compact basis whose components are its color channels. `glimpse_core` evaluates this basis
//! like a fit of the model Linear, and does not need the material.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::{Nodes, map};
use glimpse_materials::Material;
use rayon::prelude::*;

use super::compact::pack;

/// The nodes of the basis of a material, which takes 302 kB. Twice the number of nodes along any axis reduces the error
/// little.
pub const MATERIAL_NODES: Nodes = Nodes {
    theta_h: 90,
    theta_d: 60,
    phi_d: 8,
};
/// The coefficients of red, green and blue that reproduce the material.
pub const CHANNEL_COEFFICIENTS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// Returns a material as the file of a compact basis with three components, for [`CHANNEL_COEFFICIENTS`].
///
/// The material is averaged over its mirror image and over exchange of light and sensor, because a basis has these
/// symmetries. Non-finite values are replaced by 0.
#[must_use]
pub fn material_basis(material: &dyn Material, nodes: Nodes) -> Vec<u8> {
    let [rows, columns] = [nodes.theta_d, nodes.phi_d].map(usize::from);
    let values: Vec<[f64; 3]> = (0..nodes.count().unwrap_or_default())
        .into_par_iter()
        .map(|node| {
            let indices = [
                node / (rows * columns),
                node / columns % rows,
                node % columns,
            ];
            mapped_brdf(material, angles_at(nodes, indices))
        })
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
    pack(0, nodes, &[means, channel(0), channel(1), channel(2)])
}

/// Returns the angles of a node: the inverse of the coordinates in `core/docs/basis.md`.
fn angles_at(nodes: Nodes, indices: [usize; 3]) -> Angles<f64> {
    let shape = [nodes.theta_h, nodes.theta_d, nodes.phi_d];
    let [u, v, p] = [0, 1, 2].map(|axis| indices[axis] as f64 / f64::from(shape[axis] - 1));
    let theta_h = 2.0 * (u * u / SQRT_2).min(1.0).asin();
    let theta_d = (1.0 - v).acos();
    let steepness = theta_h.min(FRAC_PI_2).tan() * theta_d.tan();
    Angles {
        theta_h,
        theta_d,
        phi_d: ((1.0 - p * p) / steepness.max(1.0)).acos(),
    }
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

    #[test]
    fn material_basis_reproduces_material() {
        for material in Procedural::set(5, 3) {
            let bytes = material_basis(&material, MATERIAL_NODES);
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
