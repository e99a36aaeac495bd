//! A tensor file: it is refused, or it is a BRDF.

use glimpse_materials::RglMeasurement;

use crate::{Folder, look, refused};

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write("felt_rgb.bsdf", bytes);
    match RglMeasurement::read(&path) {
        Ok(material) => look(&material),
        Err(error) => refused(&error, "felt_rgb.bsdf"),
    }
}
