//! Check of RGL tensor files: the reader rejects a file, or returns a valid BRDF.

use glimpse_materials::RglMeasurement;

use crate::{Folder, check_material, check_rejection};

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write("input_rgb.bsdf", bytes);
    match RglMeasurement::read(&path) {
        Ok(material) => check_material(&material),
        Err(error) => check_rejection(&error, "input_rgb.bsdf"),
    }
}
