//! The forms of a table in a file.
//!
//! Two forms are converted when read: tables in single precision (f32), and tables of 360 nodes of phi_d, whose second half must
//! equal the first one.

use super::grid::{AXES, HEADER_BYTES, NODES};
use crate::error::{Defect, index_of};

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
    let index = index_of(position, &[3, NODES[0], NODES[1], NODES[2]]);
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
