//! A single material as a basis whose components are its color channels. `glimpse_core` evaluates this basis
//! like a fit of the model Linear, and does not need the material.

use std::f64::consts::{PI, TAU};

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::map;
use glimpse_materials::Material;
use rayon::prelude::*;

use super::compact::{HOST_NODES, angles_at, pack};

/// The coefficients of red, green and blue that reproduce the material.
pub const CHANNEL_COEFFICIENTS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// Returns a material as the file of a basis at [`HOST_NODES`] with three components, in 907 kB, for [`CHANNEL_COEFFICIENTS`].
///
/// The material is averaged over its mirror image and over exchange of light and sensor, because a basis has these
/// symmetries. Non-finite values are replaced by 0.
#[must_use]
pub fn material_basis(material: &dyn Material) -> Vec<u8> {
    let values: Vec<[f64; 3]> = (0..HOST_NODES.count().unwrap_or_default())
        .into_par_iter()
        .map(|node| mapped_brdf(material, angles_at(HOST_NODES, node)))
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
    pack(0, HOST_NODES, &[means, channel(0), channel(1), channel(2)])
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
