//! A tensor file: it is refused, or it is a BRDF.

#![no_main]

use glimpse_trainer::material::RglMeasurement;
use glimpse_trainer_fuzz::{Folder, look, refused};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = Folder::new();
    let path = folder.write("felt_rgb.bsdf", bytes);
    match RglMeasurement::read(&path) {
        Ok(material) => look(&material),
        Err(error) => refused(&error, "felt_rgb.bsdf"),
    }
});
