//! The compact basis: a whole basis on a coarser grid, in bytes that core reads in place.
//!
//! The grid is core's ([`Nodes`]), and so are the shares of nodes in an interpolation. The values
//! at the nodes are not those of the whole basis there but those whose interpolation comes nearest
//! to it in between, which is worth several times as many nodes.

use std::f64::consts::TAU;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::Nodes;
use glimpse_core::model::linear::format::{MAGIC, VERSION, checksum_of};
use glimpse_materials::basis::{Basis, widened};
use glimpse_materials::sampling::uniform_valid;
use rayon::prelude::*;

use super::least_squares::LeastSquares;

/// Components of a compact basis, where nothing else is asked for.
pub const COMPACT_COMPONENTS: usize = 24;
/// The nodes of a compact basis. `core/docs/basis.md` has the figures of others.
pub const COMPACT_NODES: Nodes = Nodes {
    theta_h: 24,
    theta_d: 31,
    phi_d: 9,
};
/// Directions that values at nodes are fitted at: always the same ones.
const DIRECTIONS: usize = 1 << 18;
const SEED: u64 = 0x6261_7369;
/// The weight of a difference between neighbors, beside that of the directions that a node has in
/// the mean.
const SMOOTHNESS: f64 = 1e-3;
/// The largest entries of a row, of a row's scale and of a mean.
const ENTRY: f64 = 127.0;
const ROW_SCALE: f64 = 65_535.0;
const MEAN: f64 = 32_767.0;

/// Returns the file of a compact basis of the first components, or of all if there are fewer;
/// [`glimpse_core::model::linear::Basis`] reads it.
///
/// The same bytes whenever it is made of the same basis. `nodes` are two at least along each
/// axis.
#[must_use]
pub fn compact(basis: &Basis, components: usize, nodes: Nodes) -> Vec<u8> {
    let components = components.clamp(1, basis.components());
    let columns = columns_at_nodes(basis, components, nodes);
    pack(basis.named_by(), nodes, &columns)
}

/// The mean of ln(1 + f w / e), then components, each at all nodes.
fn columns_at_nodes(basis: &Basis, components: usize, nodes: Nodes) -> Vec<Vec<f64>> {
    let places = Places::new(nodes);
    let angles = uniform_valid(DIRECTIONS, SEED);
    let rows = angles.iter().map(|angles| {
        let corners = nodes.corners(&HalfDifference::from_angles(*angles));
        corners.map(|corner| (places.of(corner.node), corner.share))
    });
    let smoothness = SMOOTHNESS * DIRECTIONS as f64 / places.count() as f64;
    let system = LeastSquares::new(places.count(), rows.collect(), places.pairs(), smoothness);

    let values: Vec<Vec<f32>> = angles
        .par_iter()
        .map(|angles| mirrored(basis, &widened(angles), components))
        .collect();
    (0..=components)
        .into_par_iter()
        .map(|column| {
            let known: Vec<f32> = values.iter().map(|row| row[column]).collect();
            let found = system.solve(&known);
            let nodes = 0..places.count();
            nodes.map(|node| found[places.of(node) as usize]).collect()
        })
        .collect()
}

/// Returns the columns at some angles, averaged with their mirror image.
fn mirrored(basis: &Basis, angles: &Angles<f64>, components: usize) -> Vec<f32> {
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

/// A compact basis's file: the checksum of what it was made of, and the mean of ln(1 + f w / e), then
/// components, each at all nodes.
pub(super) fn pack(of: u32, nodes: Nodes, columns: &[Vec<f64>]) -> Vec<u8> {
    let (means, columns) = columns.split_at(1);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mean_scale = (largest(&means[0]) / MEAN) as f32;
    let spans: Vec<f64> = columns.iter().map(|column| largest(column)).collect();

    let mut body = of.to_le_bytes().to_vec();
    let shape = [nodes.theta_h, nodes.theta_d, nodes.phi_d];
    for count in [columns.len() as u16].iter().chain(&shape) {
        body.extend(count.to_le_bytes());
    }
    body.extend(mean_scale.to_le_bytes());
    for span in &spans {
        body.extend(((span / (ENTRY * ROW_SCALE)) as f32).to_le_bytes());
    }
    for (node, mean) in means[0].iter().enumerate() {
        let mean = ratio(*mean, f64::from(mean_scale)).round() as i16;
        let row: Vec<f64> = columns
            .iter()
            .zip(&spans)
            .map(|(column, span)| ratio(column[node], *span))
            .collect();
        // Rounded up, so that no entry is cut.
        let scale = (largest(&row) * ROW_SCALE).ceil().min(ROW_SCALE);
        body.extend(mean.to_le_bytes());
        body.extend((scale as u16).to_le_bytes());
        for entry in row {
            let entry = ratio(entry * ENTRY * ROW_SCALE, scale).round() as i8;
            body.push(entry.cast_unsigned());
        }
    }
    let length = body.len() as u32;
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(length.to_le_bytes());
    bytes.extend(checksum_of(VERSION, length, &body).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// Which nodes stand for the same place: where the half vector is the normal, or both directions
/// are the half vector, phi_d means nothing.
struct Places {
    nodes: Nodes,
}

impl Places {
    fn new(nodes: Nodes) -> Self {
        Self { nodes }
    }

    /// How many nodes there are.
    fn count(&self) -> usize {
        self.nodes.count().unwrap_or_default()
    }

    fn index(&self, [u, v, p]: [usize; 3]) -> usize {
        let [_, rows, columns] = self.shape();
        (u * rows + v) * columns + p
    }

    fn shape(&self) -> [usize; 3] {
        [self.nodes.theta_h, self.nodes.theta_d, self.nodes.phi_d].map(usize::from)
    }

    /// The first node at the same place.
    fn of(&self, node: usize) -> u32 {
        let [_, rows, columns] = self.shape();
        let (u, v) = (node / (rows * columns), node / columns % rows);
        let first = if u == 0 || v == 0 {
            node - node % columns
        } else {
            node
        };
        first as u32
    }

    /// Places beside each other.
    fn pairs(&self) -> Vec<(u32, u32)> {
        let shape = self.shape();
        let mut pairs = Vec::new();
        for node in 0..self.count() {
            let [_, rows, columns] = shape;
            let at = [
                node / (rows * columns),
                node / columns % rows,
                node % columns,
            ];
            for axis in 0..3 {
                let mut next = at;
                next[axis] += 1;
                let (one, other) = (self.of(node), self.of(self.index(next)));
                if next[axis] < shape[axis] && one != other {
                    pairs.push((one, other));
                }
            }
        }
        pairs
    }
}

/// a / b, or 0 where b is 0 (and a with it).
fn ratio(a: f64, b: f64) -> f64 {
    if b == 0.0 { 0.0 } else { a / b }
}
