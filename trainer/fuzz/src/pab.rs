//! Check of PAB-Opto text sets: the reader rejects a set, or returns a valid BRDF.
//!
//! An input contains the texts of a set, separated by zero bytes.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::{Brdf, PabSet};

use crate::{ANGLES, Folder, check_rejection};

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    for (index, text) in bytes.split(|byte| *byte == 0).take(8).enumerate() {
        folder.write(&format!("input_in{index}.txt"), text);
    }
    match PabSet::read(&folder.path().join("input_in0.txt")) {
        Ok(set) => {
            let directions = ANGLES.map(HalfDifference::from_angles);
            let mut brdf = [[0.0; 3]; ANGLES.len()];
            set.evaluate(&directions, &mut brdf);
            let is_valid = |value: &f32| value.is_finite() && *value >= 0.0;
            assert!(brdf.as_flattened().iter().all(is_valid), "{brdf:?}");
        }
        Err(error) => check_rejection(&error, "input_in"),
    }
}
