//! Writing of any BRDF as a MERL table.

use std::io;
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::nodes::header;
use super::{FILE_BYTES, NODES, NOT_MEASURED, SCALE, node_theta_h, whole_degree};
use crate::files::write_atomic;
use crate::{Brdf, Material, NotFinite, SourceError};

/// Tabulates a BRDF at MERL's nodes. Returns the bytes of a `NAME.binary`.
///
/// Nodes below the horizon are marked as not measured. Negative values are written as 0, because they would mean "not
/// measured".
///
/// # Errors
/// If the BRDF is not finite at a node.
pub fn to_merl(brdf: &(impl Brdf + ?Sized)) -> Result<Vec<u8>, NotFinite> {
    let rows: Vec<Vec<[f64; 3]>> = (0..NODES[0] * NODES[1])
        .into_par_iter()
        .map(|row| {
            tabulate_row(
                brdf,
                node_theta_h(row / NODES[1]),
                whole_degree(row % NODES[1]),
            )
        })
        .collect::<Result<_, _>>()?;
    let mut bytes = Vec::with_capacity(FILE_BYTES);
    bytes.extend_from_slice(&header());
    for channel in 0..SCALE.len() {
        for values in rows.iter().flatten() {
            bytes.extend_from_slice(&values[channel].to_le_bytes());
        }
    }
    Ok(bytes)
}

/// Tabulates a material with [`to_merl`] and writes the file atomically.
///
/// # Errors
/// If the material is not finite at a node, or the file cannot be written.
pub fn write_merl(path: &Path, material: &dyn Material) -> Result<(), SourceError> {
    let write_error = |source| SourceError::Write {
        path: path.into(),
        source,
    };
    let bytes = to_merl(material)
        .map_err(|error| write_error(io::Error::new(io::ErrorKind::InvalidData, error)))?;
    write_atomic(path, &bytes).map_err(write_error)
}

/// Returns the stored values of a BRDF at one theta_h and theta_d, in radians, and all nodes of phi_d.
fn tabulate_row(
    brdf: &(impl Brdf + ?Sized),
    theta_h: f64,
    theta_d: f64,
) -> Result<Vec<[f64; 3]>, NotFinite> {
    let stored_value = |phi_node: usize| {
        let angles = Angles {
            theta_h: theta_h as f32,
            theta_d: theta_d as f32,
            phi_d: whole_degree(phi_node) as f32,
        };
        if !HalfDifference::from_angles(angles).is_valid() {
            return Ok([NOT_MEASURED; 3]);
        }
        let values = brdf.at_angles(angles);
        NotFinite::check(angles, values)?;
        Ok(std::array::from_fn(|channel| {
            f64::from(values[channel]).max(0.0) / SCALE[channel]
        }))
    };
    (0..NODES[2]).map(stored_value).collect()
}
