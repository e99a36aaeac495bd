//! The file of a basis, in a format that `glimpse_core` reads in place.
//!
//! `glimpse_core` defines the grid ([`Nodes`]) and the interpolation weights. A host's file has samples of the basis at
//! [`HOST_NODES`]. A device's, the compact basis, has a least-squares fit of the interpolation, which needs several times
//! fewer nodes.

use std::f64::consts::{FRAC_PI_2, SQRT_2, TAU};
use std::iter::once;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::Nodes;
use glimpse_core::model::linear::format::FORMAT;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::lists::indices;
use glimpse_materials::sampling::uniform_valid;
use rayon::prelude::*;

use super::least_squares::LeastSquares;

/// The default number of components of a compact basis.
pub const COMPACT_COMPONENTS: usize = 24;
/// The default nodes of a compact basis. `core/docs/basis.md` compares other numbers of nodes.
pub const COMPACT_NODES: Nodes = Nodes {
    theta_h: 24,
    theta_d: 31,
    phi_d: 9,
};
/// The nodes of a host's file. Twice the number along any axis reduces the error little.
pub const HOST_NODES: Nodes = Nodes {
    theta_h: 90,
    theta_d: 60,
    phi_d: 24,
};
/// The number of random directions of the least-squares fit.
const DIRECTIONS: usize = 1 << 18;
/// The seed of these directions.
const SEED: u64 = 0x6261_7369;
/// The weight of the squared difference between two adjacent nodes, relative to the mean weight of the directions per
/// node.
const SMOOTHNESS: f64 = 1e-3;
/// The largest quantized entry of a row.
const MAX_ENTRY: f64 = 127.0;
/// The largest quantized scale of a row.
const MAX_ROW_SCALE: f64 = 65_535.0;
/// The largest quantized mean.
const MAX_MEAN: f64 = 32_767.0;

/// Returns the content of a host's file, with all components.
#[must_use]
pub fn to_host_bytes(basis: &BasisTable) -> Vec<u8> {
    let count = HOST_NODES.count().unwrap_or_default();
    let rows: Vec<Vec<f32>> = (0..count)
        .into_par_iter()
        .map(|node| symmetrized(basis, &angles_at(HOST_NODES, node), basis.components()))
        .collect();
    let column = |index: usize| rows.iter().map(|row| f64::from(row[index])).collect();
    let columns: Vec<Vec<f64>> = (0..=basis.components()).map(column).collect();
    pack(basis.checksum(), HOST_NODES, &columns)
}

/// Returns the content of a compact basis file, which [`glimpse_core::model::linear::Basis`] reads. It has the first
/// `components` components, or all if the basis has fewer.
///
/// The bytes are deterministic. `nodes` must have at least two nodes along each axis.
#[must_use]
pub fn to_compact_bytes(basis: &BasisTable, components: usize, nodes: Nodes) -> Vec<u8> {
    let components = components.clamp(1, basis.components());
    let columns = columns_at_nodes(basis, components, nodes);
    pack(basis.checksum(), nodes, &columns)
}

/// Returns the mean of ln(1 + f w / e) at all nodes, then each component at all nodes.
///
/// f is the BRDF in sr⁻¹, w is cos(theta_i) cos(theta_o), and e is the constant of
/// [`map`](glimpse_core::model::linear::map).
fn columns_at_nodes(basis: &BasisTable, components: usize, nodes: Nodes) -> Vec<Vec<f64>> {
    let count = nodes.count().unwrap_or_default();
    let angles = uniform_valid(DIRECTIONS, SEED);
    let rows = angles.iter().map(|angles| {
        let corners = nodes.corners(&HalfDifference::from_angles(*angles));
        corners.map(|corner| (unknown_of(nodes, corner.node), corner.weight))
    });
    let smoothness = SMOOTHNESS * DIRECTIONS as f64 / count as f64;
    let system = LeastSquares::new(count, rows.collect(), neighbors(nodes), smoothness);

    let values: Vec<Vec<f32>> = angles
        .par_iter()
        .map(|angles| symmetrized(basis, &angles.map(f64::from), components))
        .collect();
    (0..=components)
        .into_par_iter()
        .map(|column| {
            let targets: Vec<f32> = values.iter().map(|row| row[column]).collect();
            let solution = system.solve(&targets);
            (0..count)
                .map(|node| solution[unknown_of(nodes, node) as usize])
                .collect()
        })
        .collect()
}

/// Returns the mean and the components, each averaged over the angles and their mirror image at 2 pi - phi_d.
fn symmetrized(basis: &BasisTable, angles: &Angles<f64>, components: usize) -> Vec<f32> {
    let [one, other] = [angles.phi_d, TAU - angles.phi_d].map(|phi_d| {
        let entry = basis.look_up(Angles { phi_d, ..*angles });
        once(entry.center).chain(entry.components)
    });
    let pairs = one.zip(other).take(1 + components);
    pairs
        .map(|(one, other)| (0.5 * (one[0] + other[0])) as f32)
        .collect()
}

/// Returns the content of a compact basis file. `columns` are the mean and the components at all nodes, as in
/// [`columns_at_nodes`]. `checksum` is [`BasisTable::checksum`].
pub(super) fn pack(checksum: u32, nodes: Nodes, columns: &[Vec<f64>]) -> Vec<u8> {
    let (means, columns) = columns.split_at(1);
    let max_magnitude = |values: &[f64]| values.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let mean_scale = (max_magnitude(&means[0]) / MAX_MEAN) as f32;
    let magnitudes: Vec<f64> = columns.iter().map(|column| max_magnitude(column)).collect();

    let mut body = checksum.to_le_bytes().to_vec();
    let shape = [nodes.theta_h, nodes.theta_d, nodes.phi_d];
    for count in [columns.len() as u16].iter().chain(&shape) {
        body.extend(count.to_le_bytes());
    }
    body.extend(mean_scale.to_le_bytes());
    for magnitude in &magnitudes {
        body.extend(((magnitude / (MAX_ENTRY * MAX_ROW_SCALE)) as f32).to_le_bytes());
    }
    for (node, mean) in means[0].iter().enumerate() {
        let mean = ratio(*mean, f64::from(mean_scale)).round() as i16;
        let row: Vec<f64> = columns
            .iter()
            .zip(&magnitudes)
            .map(|(column, magnitude)| ratio(column[node], *magnitude))
            .collect();
        // Rounded up, so that no entry is clipped.
        let scale = (max_magnitude(&row) * MAX_ROW_SCALE)
            .ceil()
            .min(MAX_ROW_SCALE);
        body.extend(mean.to_le_bytes());
        body.extend((scale as u16).to_le_bytes());
        for entry in row {
            let entry = ratio(entry * MAX_ENTRY * MAX_ROW_SCALE, scale).round() as i8;
            body.push(entry.cast_unsigned());
        }
    }
    [&FORMAT.header(&body)[..], &body].concat()
}

/// Returns the angles of a node: the inverse of the coordinates in `core/docs/basis.md`.
pub(super) fn angles_at(nodes: Nodes, node: usize) -> Angles<f64> {
    let (indices, shape) = (indices(node, shape(nodes)), shape(nodes));
    let [u, v, p] = [0, 1, 2].map(|axis| indices[axis] as f64 / (shape[axis] - 1) as f64);
    let theta_h = 2.0 * (u * u / SQRT_2).min(1.0).asin();
    let theta_d = (1.0 - v).acos();
    let steepness = theta_h.min(FRAC_PI_2).tan() * theta_d.tan();
    Angles {
        theta_h,
        theta_d,
        phi_d: ((1.0 - p * p) / steepness.max(1.0)).acos(),
    }
}

/// Returns the number of nodes along the axes theta_h, theta_d and phi_d.
fn shape(nodes: Nodes) -> [usize; 3] {
    [nodes.theta_h, nodes.theta_d, nodes.phi_d].map(usize::from)
}

/// Returns the unknown of a node in the least-squares fit: the index of the first node with the same direction. Nodes at
/// theta_h = 0 or theta_d = 0 that differ only in phi_d have the same direction.
fn unknown_of(nodes: Nodes, node: usize) -> u32 {
    let [u, v, p] = indices(node, shape(nodes));
    let first = if u == 0 || v == 0 { node - p } else { node };
    first as u32
}

/// Returns the pairs of unknowns of adjacent nodes.
fn neighbors(nodes: Nodes) -> Vec<(u32, u32)> {
    let shape = shape(nodes);
    let strides = [shape[1] * shape[2], shape[2], 1];
    let mut pairs = Vec::new();
    for node in 0..nodes.count().unwrap_or_default() {
        for (axis, index) in indices(node, shape).into_iter().enumerate() {
            if index + 1 < shape[axis] {
                let pair = [node, node + strides[axis]].map(|node| unknown_of(nodes, node));
                pairs.extend((pair[0] != pair[1]).then_some((pair[0], pair[1])));
            }
        }
    }
    pairs
}

/// Returns a / b, or 0 if b is 0; a is then also 0.
fn ratio(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}
