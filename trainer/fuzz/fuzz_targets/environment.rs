//! A panorama, Radiance or OpenEXR: it is refused, or light from everywhere.

#![no_main]

use glimpse_trainer::render::Environment;
use glimpse_trainer_fuzz::{Folder, refused};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = Folder::new();
    let name = match bytes.starts_with(b"#?") {
        true => "felt.hdr",
        false => "felt.exr",
    };
    let path = folder.write(name, bytes);
    match Environment::read(&path) {
        Ok(environment) => {
            for direction in [[0.0, 1.0, 0.0], [0.6, 0.0, -0.8], [0.0, -0.6, 0.8]] {
                let radiance = environment.radiance(direction);
                let is_light = |value: &f32| value.is_finite() && *value >= 0.0;
                assert!(radiance.iter().all(is_light), "{radiance:?}");
            }
        }
        Err(error) => refused(&error, name),
    }
});
