//! The nodes of a table in its standard form, values at those that were not measured, and the other forms that are converted
//! when read: tables in single precision (f32), and tables of 360 nodes of phi_d, whose second half must equal the first one.

use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use crate::error::Defect;
use crate::lists::{add_scaled, indices};

/// The number of nodes along theta_h, theta_d and phi_d.
pub(super) const NODES: [usize; 3] = [90, 90, 180];
/// The number of values of one channel.
pub(super) const NODES_PER_CHANNEL: usize = NODES[0] * NODES[1] * NODES[2];
pub(super) const HEADER_BYTES: usize = 3 * size_of::<i32>();
pub(super) const FILE_BYTES: usize = HEADER_BYTES + 3 * NODES_PER_CHANNEL * size_of::<f64>();

/// The largest share of unmeasured nodes among those above the horizon.
pub(super) const MAX_UNMEASURED: f64 = 0.5;
/// The steps between the indices of neighboring nodes along theta_h, theta_d and phi_d.
const STRIDES: [usize; 3] = [NODES[1] * NODES[2], NODES[2], 1];

/// theta_h, theta_d and phi_d at each node, in radians. phi_d is periodic: its additional last node is the first one.
pub(super) static AXES: LazyLock<[Vec<f64>; 3]> = LazyLock::new(|| {
    let root = |k: usize| k as f64 / NODES[0] as f64;
    let whole_degree = |k: usize| (k as f64).to_radians();
    [
        (0..NODES[0])
            .map(|k| FRAC_PI_2 * root(k) * root(k))
            .collect(),
        (0..NODES[1]).map(whole_degree).collect(),
        (0..=NODES[2]).map(whole_degree).collect(),
    ]
});

/// Returns the angles of a node, in radians.
pub(super) fn node_angles(index: usize) -> Angles<f32> {
    let [_, count_d, count_phi] = NODES;
    let [theta_h, theta_d, phi_d] = &*AXES;
    Angles {
        theta_h: theta_h[index / count_phi / count_d] as f32,
        theta_d: theta_d[index / count_phi % count_d] as f32,
        phi_d: phi_d[index % count_phi] as f32,
    }
}

/// True for each node at which both directions are above the horizon. One thread computes it: while it waited for others, it could
/// begin another job that needs it, and wait for itself.
static IS_ABOVE_HORIZON: LazyLock<Vec<bool>> = LazyLock::new(|| {
    (0..NODES_PER_CHANNEL)
        .map(|index| HalfDifference::from_angles(node_angles(index)).is_valid())
        .collect()
});

/// Returns the indices of the nodes at which both directions are above the horizon.
pub(super) fn nodes_above_horizon() -> impl Iterator<Item = usize> {
    (0..NODES_PER_CHANNEL).filter(|index| IS_ABOVE_HORIZON[*index])
}

/// Returns the stored values of a node; None if it was not measured in a channel.
pub(super) fn measured_values(bytes: &[u8], index: usize) -> Option<[f64; 3]> {
    let values = bytes.get(HEADER_BYTES..)?.as_chunks().0;
    let mut node = [0.0; 3];
    for (channel, value) in node.iter_mut().enumerate() {
        *value = f64::from_le_bytes(*values.get(index + channel * NODES_PER_CHANNEL)?);
        if !(0.0..=f64::from(f32::MAX)).contains(value) {
            return None;
        }
    }
    Some(node)
}

/// The unmeasured nodes above the horizon.
pub(super) struct Unmeasured(Vec<usize>);

impl Unmeasured {
    /// Finds the unmeasured nodes of a table.
    pub(super) fn find(bytes: &[u8]) -> Self {
        let nodes = nodes_above_horizon();
        Self(
            nodes
                .filter(|index| measured_values(bytes, *index).is_none())
                .collect(),
        )
    }

    /// Returns the share of these nodes among those above the horizon.
    pub(super) fn share(&self) -> f64 {
        self.0.len() as f64 / nodes_above_horizon().count() as f64
    }

    /// Fills the nodes. Those without a measured neighbor follow after their neighbors.
    pub(super) fn fill(mut self, bytes: &mut [u8]) {
        while !self.0.is_empty() {
            let nodes = self.0.par_iter();
            let filled =
                nodes.filter_map(|index| Some((*index, mean_of_neighbors(bytes, *index)?)));
            let filled: Vec<(usize, [f64; 3])> = filled.collect();
            if filled.is_empty() {
                return;
            }
            let (values, _) = bytes[HEADER_BYTES..].as_chunks_mut();
            for (index, node) in filled {
                for (channel, value) in node.into_iter().enumerate() {
                    values[index + channel * NODES_PER_CHANNEL] = value.to_le_bytes();
                }
            }
            self.0
                .retain(|index| measured_values(bytes, *index).is_none());
        }
    }
}

/// Returns the mean of the nearest measured nodes above the horizon along theta_h, theta_d and phi_d, weighted by inverse
/// distance in nodes. An angle counts if it has such a node on both sides, or if no angle has.
fn mean_of_neighbors(bytes: &[u8], index: usize) -> Option<[f64; 3]> {
    let nearest = |axis: usize, is_upward: bool| {
        let position = index / STRIDES[axis] % NODES[axis];
        (1..NODES[axis]).find_map(|distance| {
            let count = NODES[axis];
            let neighbor = match is_upward {
                true => count + position + distance,
                false => count + position - distance,
            };
            // phi_d is periodic. Both other angles end.
            let exists = axis == 2 || (count..2 * count).contains(&neighbor);
            let other = index - position * STRIDES[axis] + neighbor % count * STRIDES[axis];
            let values = measured_values(bytes, other);
            let values = values.filter(|_| exists && IS_ABOVE_HORIZON[other])?;
            Some((1.0 / distance as f64, values))
        })
    };
    let axes = [0, 1, 2].map(|axis| [false, true].map(|is_upward| nearest(axis, is_upward)));
    let is_between = |sides: &[Option<_>; 2]| sides.iter().all(Option::is_some);
    let has_between = axes.iter().any(is_between);
    let used = axes
        .iter()
        .filter(|sides| !has_between || is_between(sides));
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (weight, values) in used.flatten().flatten() {
        total += weight;
        add_scaled(&mut sum, *weight, values);
    }
    (total > 0.0).then(|| sum.map(|sum| sum / total))
}

/// The number of nodes of phi_d in a table of all azimuths.
const ALL_AZIMUTHS: usize = 2 * NODES[2];
/// The largest relative difference of two values whose phi_d differ by pi.
const HALVES_TOLERANCE: f64 = 1e-3;
/// Names of the channels.
pub(super) const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// Returns the number of nodes of phi_d in a header; None if it is not that of a table.
fn phi_nodes(bytes: &[u8]) -> Option<usize> {
    [NODES[2], ALL_AZIMUTHS].into_iter().find(|phi| {
        let dimensions = [NODES[0], NODES[1], *phi].map(|nodes| (nodes as i32).to_le_bytes());
        bytes.starts_with(dimensions.as_flattened())
    })
}

/// Returns true if the first bytes of a file are the dimensions of a table.
pub(crate) fn has_signature(head: &[u8]) -> bool {
    phi_nodes(head).is_some()
}

/// The form of a table in a file.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Form {
    phi_nodes: usize,
    /// The number of bytes of a value.
    width: usize,
}

impl Form {
    pub(super) const STANDARD: Self = Self {
        phi_nodes: NODES[2],
        width: 8,
    };

    /// Finds the form by the header and the length.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, Defect> {
        let phi_nodes =
            phi_nodes(bytes).ok_or("it does not start with the dimensions of a MERL table")?;
        let length = bytes.len();
        let expected = |width: usize| HEADER_BYTES + 3 * NODES[0] * NODES[1] * phi_nodes * width;
        match [8, 4].into_iter().find(|width| expected(*width) == length) {
            Some(width) => Ok(Self { phi_nodes, width }),
            None => Err(format!(
                "it has {length} bytes, and a MERL table has {}, or {} in single precision",
                expected(8),
                expected(4)
            )
            .into()),
        }
    }

    /// Converts the values of a file to those of a file in the standard form.
    pub(super) fn convert(self, bytes: &[u8], standard: &mut [u8]) -> Result<(), Defect> {
        let header = NODES.map(|nodes| (nodes as i32).to_le_bytes());
        standard[..HEADER_BYTES].copy_from_slice(header.as_flattened());
        let (converted, _) = standard[HEADER_BYTES..].as_chunks_mut();
        let values = &bytes[HEADER_BYTES..];
        let value = |index: usize| match self.width {
            4 => f64::from(f32::from_le_bytes(values.as_chunks().0[index])),
            _ => f64::from_le_bytes(values.as_chunks().0[index]),
        };
        for (position, converted) in converted.iter_mut().enumerate() {
            let index = position / NODES[2] * self.phi_nodes + position % NODES[2];
            let first = value(index);
            if self.phi_nodes == ALL_AZIMUTHS {
                let second = value(index + NODES[2]);
                let tolerance = HALVES_TOLERANCE * first.abs().max(second.abs());
                if !(first < 0.0 && second < 0.0 || (first - second).abs() <= tolerance) {
                    return Err(Defect::new(
                        format!(
                            "its value of {} is {first:e}, and {second:e} at the opposite phi_d",
                            place(position)
                        ),
                        "average both halves of phi_d to a table of 180 values",
                    ));
                }
            }
            *converted = first.to_le_bytes();
        }
        Ok(())
    }
}

/// Describes the color and the angles of a value.
fn place(position: usize) -> String {
    let index = indices(position, [3, NODES[0], NODES[1], NODES[2]]);
    format!(
        "{} at theta_h {:.3}, theta_d {} and phi_d {} degrees",
        CHANNELS[index[0]],
        AXES[0][index[1]].to_degrees(),
        index[2],
        index[3]
    )
}

/// Checks the values of a file in the standard form.
pub(super) fn check(bytes: &[u8]) -> Result<(), Defect> {
    let (values, _) = bytes[HEADER_BYTES..].as_chunks();
    let mut values = values.iter().copied().map(f64::from_le_bytes).enumerate();
    // The comparison is false for NaN.
    let is_in_range = |value: f64| value.abs() <= f64::from(f32::MAX);
    match values.find(|(_, value)| !is_in_range(*value)) {
        None => Ok(()),
        Some((position, value)) => Err(format!(
            "its value of {} is {value:e}, not finite as a 32-bit float",
            place(position)
        )
        .into()),
    }
}
