//! Writing of any BRDF as a MERL table.

use std::io;
use std::path::Path;

use rayon::prelude::*;

use super::FILE_BYTES;
use super::nodes::{encode, table_nodes};
use crate::files::write_atomic;
use crate::{Brdf, Material, NotFinite, SourceError};

/// Tabulates a BRDF at MERL's nodes. Returns the bytes of a `NAME.binary`.
///
/// Nodes below the horizon are marked as not measured. Negative values are written as 0.
///
/// # Errors
/// If the BRDF is not finite at a node.
pub fn to_merl(brdf: &(impl Brdf + ?Sized)) -> Result<Vec<u8>, NotFinite> {
    let nodes = table_nodes();
    let values = nodes.par_iter().map(|angles| brdf.at_angles(*angles));
    let values: Vec<[f32; 3]> = values.collect();
    for (angles, rgb) in nodes.into_iter().zip(&values) {
        NotFinite::check(angles, *rgb)?;
    }
    let mut bytes = vec![0; FILE_BYTES];
    encode(&values, &mut bytes);
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
