//! A single material as a compact basis, whose components are its color channels: core evaluates it as it
//! does a scan by the model Linear, where the material itself cannot go.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::{Nodes, map};
use glimpse_materials::Material;
use rayon::prelude::*;

use super::compact::pack;

/// The nodes of a single material's table: 302 kB. Twice as many along any axis gain little.
pub const SINGLE_NODES: Nodes = Nodes {
    theta_h: 90,
    theta_d: 60,
    phi_d: 8,
};
/// The coefficients of red, green and blue by which the table gives the material back.
pub const CHANNELS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// A material as a compact basis of three components, for [`CHANNELS`]. It is averaged with its mirror
/// image and with light and sensor exchanged, as the table cannot tell these apart; where it has no
/// finite value it is black.
#[must_use]
pub fn single_material(material: &dyn Material, nodes: Nodes) -> Vec<u8> {
    let [rows, columns] = [nodes.theta_d, nodes.phi_d].map(usize::from);
    let values: Vec<[f64; 3]> = (0..nodes.count().unwrap_or_default())
        .into_par_iter()
        .map(|node| {
            let at = [
                node / (rows * columns),
                node / columns % rows,
                node % columns,
            ];
            mapped(material, angles_at(nodes, at))
        })
        .collect();
    // In the middle of the channels, so that what is left for the components is least.
    let middle = |value: &[f64; 3]| {
        let [red, green, blue] = *value;
        0.5 * (red.min(green).min(blue) + red.max(green).max(blue))
    };
    let means = values.iter().map(middle).collect();
    let channel = |index: usize| {
        let values = values.iter();
        values.map(|value| value[index] - middle(value)).collect()
    };
    pack(0, nodes, &[means, channel(0), channel(1), channel(2)])
}

/// Where a node is: the inverse of the coordinates that `core/docs/basis.md` gives.
fn angles_at(nodes: Nodes, at: [usize; 3]) -> Angles<f64> {
    let shape = [nodes.theta_h, nodes.theta_d, nodes.phi_d];
    let [u, v, p] = [0, 1, 2].map(|axis| at[axis] as f64 / f64::from(shape[axis] - 1));
    let theta_h = 2.0 * (u * u / SQRT_2).min(1.0).asin();
    let theta_d = (1.0 - v).acos();
    let steepness = theta_h.min(FRAC_PI_2).tan() * theta_d.tan();
    Angles {
        theta_h,
        theta_d,
        phi_d: ((1.0 - p * p) / steepness.max(1.0)).acos(),
    }
}

/// ln(1 + f w / e) of each channel, in the mean over what should be the same.
fn mapped(material: &dyn Material, at: Angles<f64>) -> [f64; 3] {
    let cosines = {
        let across = at.theta_h.sin() * at.theta_d.sin() * at.phi_d.cos();
        let along = at.theta_h.cos() * at.theta_d.cos();
        [along - across, along + across]
    };
    let weight = cosines[0].max(0.0) * cosines[1].max(0.0);
    let mut sum = [0.0; 3];
    for phi_d in [at.phi_d, TAU - at.phi_d, PI - at.phi_d, PI + at.phi_d] {
        let brdf = material.brdf(Angles {
            theta_h: at.theta_h as f32,
            theta_d: at.theta_d as f32,
            phi_d: phi_d as f32,
        });
        for (sum, value) in sum.iter_mut().zip(brdf) {
            let value = if value.is_finite() {
                value.max(0.0)
            } else {
                0.0
            };
            *sum += 0.25 * map(f64::from(value), 0.0, weight);
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
    fn nodes_are_where_core_looks_for_them() {
        let nodes = Nodes {
            theta_h: 9,
            theta_d: 8,
            phi_d: 5,
        };
        for node in 0..9 * 8 * 5 {
            let at = [node / 40, node / 5 % 8, node % 5];
            let Angles {
                theta_h,
                theta_d,
                phi_d,
            } = angles_at(nodes, at);
            let at = HalfDifference::from_angles(Angles {
                theta_h: theta_h as f32,
                theta_d: theta_d as f32,
                phi_d: phi_d as f32,
            });
            // Light and sensor at the very horizon, or an azimuth that means nothing.
            if node / 40 == 0 || node / 5 % 8 == 0 || at.cos_theta_i().min(at.cos_theta_o()) < 1e-4
            {
                continue;
            }
            let share: f32 = nodes
                .corners(&at)
                .iter()
                .filter(|corner| corner.node == node)
                .map(|corner| corner.share)
                .sum();
            assert!(share > 0.98, "{node}: {share}");
        }
    }

    #[test]
    fn a_table_gives_its_material_back() {
        for material in Procedural::set(5, 3) {
            let bytes = single_material(&material, SINGLE_NODES);
            let table = Basis::parse(&bytes).expect("it is a compact basis");
            // Over directions spread evenly: of those drawn at random, a few near a highlight decide.
            let found = |at: &HalfDifference<f32>| {
                table.brdf(CHANNELS, at).expect("it is above the horizon")
            };
            let mean = glimpse_materials::loss::loss_between(&found, &material);
            assert!(mean < 1.5e-3, "{}: {mean}", material.name());
        }
    }
}
