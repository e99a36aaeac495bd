//! The file of a basis, in a format that `glimpse_core` reads in place.
//!
//! `glimpse_core` defines the grid ([`Nodes`]) and the interpolation weights. A host's file has samples of the basis at
//! [`HOST_NODES`]. A device's, the compact basis, has a least-squares fit of the interpolation, which needs several times
//! fewer nodes.

use std::f64::consts::{FRAC_PI_2, SQRT_2, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::Nodes;
use glimpse_core::model::linear::format::FORMAT;
use glimpse_materials::basis::Basis;
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
pub fn to_host_bytes(basis: &Basis) -> Vec<u8> {
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
pub fn to_compact_bytes(basis: &Basis, components: usize, nodes: Nodes) -> Vec<u8> {
    let components = components.clamp(1, basis.components());
    let columns = columns_at_nodes(basis, components, nodes);
    pack(basis.checksum(), nodes, &columns)
}

/// Returns the mean of ln(1 + f w / e) at all nodes, then each component at all nodes.
///
/// f is the BRDF in sr⁻¹, w is cos(theta_i) cos(theta_o), and e is the constant of
/// [`map`](glimpse_core::model::linear::map).
fn columns_at_nodes(basis: &Basis, components: usize, nodes: Nodes) -> Vec<Vec<f64>> {
    let unknowns = Unknowns::new(nodes);
    let angles = uniform_valid(DIRECTIONS, SEED);
    let rows = angles.iter().map(|angles| {
        let corners = nodes.corners(&HalfDifference::from_angles(*angles));
        corners.map(|corner| (unknowns.of_node(corner.node), corner.weight))
    });
    let smoothness = SMOOTHNESS * DIRECTIONS as f64 / unknowns.node_count() as f64;
    let system = LeastSquares::new(
        unknowns.node_count(),
        rows.collect(),
        unknowns.neighbors(),
        smoothness,
    );

    let values: Vec<Vec<f32>> = angles
        .par_iter()
        .map(|angles| symmetrized(basis, &angles.map(f64::from), components))
        .collect();
    (0..=components)
        .into_par_iter()
        .map(|column| {
            let targets: Vec<f32> = values.iter().map(|row| row[column]).collect();
            let solution = system.solve(&targets);
            (0..unknowns.node_count())
                .map(|node| solution[unknowns.of_node(node) as usize])
                .collect()
        })
        .collect()
}

/// Returns the mean and the components, each averaged over the angles and their mirror image at 2 pi - phi_d.
fn symmetrized(basis: &Basis, angles: &Angles<f64>, components: usize) -> Vec<f32> {
    let both =
        [angles.phi_d, TAU - angles.phi_d].map(|phi_d| basis.look_up(Angles { phi_d, ..*angles }));
    let [one, other] = &both;
    let components = one
        .components
        .iter()
        .zip(&other.components)
        .take(components);
    let values = components.map(|(one, other)| 0.5 * (one[0] + other[0]));
    let mean = 0.5 * (one.center()[0] + other.center()[0]);
    [mean]
        .into_iter()
        .chain(values)
        .map(|value| value as f32)
        .collect()
}

/// Returns the content of a compact basis file. `columns` are the mean and the components at all nodes, as in
/// [`columns_at_nodes`]. `checksum` is [`Basis::checksum`].
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
    let shape = [nodes.theta_h, nodes.theta_d, nodes.phi_d];
    let indices = Unknowns::new(nodes).indices(node);
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

/// The unknowns of the least-squares fit: one per direction. Nodes at theta_h = 0 or theta_d = 0 that differ only in
/// phi_d have the same direction, and share an unknown. Each unknown has the index of its first node.
struct Unknowns {
    nodes: Nodes,
}

impl Unknowns {
    fn new(nodes: Nodes) -> Self {
        Self { nodes }
    }

    /// Returns the number of nodes. The indices of unknowns are smaller.
    fn node_count(&self) -> usize {
        self.nodes.count().unwrap_or_default()
    }

    /// Returns the node at indices along the axes theta_h, theta_d and phi_d.
    fn node(&self, [u, v, p]: [usize; 3]) -> usize {
        let [_, v_count, p_count] = self.shape();
        (u * v_count + v) * p_count + p
    }

    /// Returns the indices of a node along the axes theta_h, theta_d and phi_d.
    fn indices(&self, node: usize) -> [usize; 3] {
        let [_, v_count, p_count] = self.shape();
        [
            node / (v_count * p_count),
            node / p_count % v_count,
            node % p_count,
        ]
    }

    /// Returns the number of nodes along each axis.
    fn shape(&self) -> [usize; 3] {
        [self.nodes.theta_h, self.nodes.theta_d, self.nodes.phi_d].map(usize::from)
    }

    /// Returns the unknown of a node: the index of the first node with the same direction.
    fn of_node(&self, node: usize) -> u32 {
        let [u, v, p] = self.indices(node);
        let first = if u == 0 || v == 0 { node - p } else { node };
        first as u32
    }

    /// Returns the pairs of unknowns of adjacent nodes.
    fn neighbors(&self) -> Vec<(u32, u32)> {
        let shape = self.shape();
        let mut pairs = Vec::new();
        for node in 0..self.node_count() {
            for axis in 0..3 {
                let mut next = self.indices(node);
                next[axis] += 1;
                let (one, other) = (self.of_node(node), self.of_node(self.node(next)));
                if next[axis] < shape[axis] && one != other {
                    pairs.push((one, other));
                }
            }
        }
        pairs
    }
}

/// Returns a / b, or 0 if b is 0; a is then also 0.
fn ratio(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}
