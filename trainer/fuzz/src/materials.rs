//! Checks of the readers of materials and bases: a reader rejects its file, or returns a valid BRDF.

use std::path::Path;

use glimpse_core::file::HEADER_BYTES;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::format::FORMAT;
use glimpse_core::model::{NeuralParameters, ParameterSet};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{Brdf, Format, PabSet, Source, to_nbrdf};

use crate::support::{ANGLES, Folder, accepted};

/// File names. The first byte of an input selects one.
const NAMES: [&str; 6] = [
    "input.binary",
    "input.bsdf",
    "input.json",
    "input.txt",
    "input_fc1.npy",
    "input",
];

/// Checks a file of any format.
pub(crate) fn check_file(input: &[u8]) {
    if let Some((name, bytes)) = input.split_first() {
        let folder = Folder::new();
        let path = folder.write(NAMES[usize::from(*name) % NAMES.len()], bytes);
        check_source(&path, "input");
        let _ = Source(folder.path().display().to_string()).skipped_entries();
    }
}

/// Checks the six arrays of a network. The first byte of an input selects the array that the other bytes replace.
pub(crate) fn check_network(input: &[u8]) {
    let Some((replaced, bytes)) = input.split_first() else {
        return;
    };
    let folder = Folder::new();
    let mut arrays = to_nbrdf(&NeuralParameters::filled(0.1));
    arrays[usize::from(*replaced) % 6] = bytes.to_vec();
    for (ending, bytes) in Format::Nbrdf.properties().written.iter().zip(arrays) {
        folder.write(&format!("input{ending}"), &bytes);
    }
    check_source(&folder.path().join("input_b2.npy"), "input_");
}

/// Checks a PAB-Opto set, whose files are separated by zero bytes.
pub(crate) fn check_set(bytes: &[u8]) {
    let folder = Folder::new();
    for (index, text) in bytes.split(|byte| *byte == 0).take(8).enumerate() {
        folder.write(&format!("input_in{index}.txt"), text);
    }
    check_source(&folder.path().join("input_in0.txt"), "input_in");
}

/// Reads the source at a path. Error messages contain `name`, the common part of its files' names.
fn check_source(path: &Path, name: &str) {
    let source = Source(path.display().to_string());
    if let Some(files) = accepted(source.files(), name) {
        assert!(files.iter().any(|file| file == path));
    }
    let is_valid = |value: &f32| value.is_finite() && *value >= 0.0;
    // Loading a complete PAB-Opto set resamples it, which takes seconds. An incomplete one is NaN at unknown directions.
    if let Ok(Format::Pab) = Format::detect(path) {
        if let Some(set) = accepted(PabSet::read(path), name) {
            let brdf = set.values_at(&ANGLES.map(HalfDifference::from_angles));
            let mut values = brdf.as_flattened().iter();
            assert!(
                values.all(|value| value.is_nan() || is_valid(value)),
                "{brdf:?}"
            );
        }
        return;
    }
    for material in accepted(source.load(), name).into_iter().flatten() {
        for (angles, (brdf, derivative)) in ANGLES.iter().zip(material.with_derivatives(&ANGLES)) {
            // Networks and fits extrapolate, and may overflow.
            if let Ok(Format::Merl | Format::Rgl | Format::RglSpectra) = Format::detect(path) {
                let values = [brdf, material.at_angles(*angles)];
                assert!(values.as_flattened().iter().all(is_valid), "{values:?}");
                let has_nan = derivative.as_flattened().iter().any(|value| value.is_nan());
                assert!(!has_nan, "{derivative:?}");
            }
        }
    }
}

/// Checks a basis. Its length and checksums are corrected first, because random bytes almost never have the right ones.
pub(crate) fn check_basis(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    if bytes.len() >= HEADER_BYTES && bytes.starts_with(&FORMAT.magic) {
        let header = FORMAT.header(&bytes[HEADER_BYTES..]);
        bytes[6..HEADER_BYTES].copy_from_slice(&header[6..]);
    }
    let Ok(basis) = BasisTable::parse(&bytes) else {
        return;
    };
    assert_eq!(basis.file(), bytes);
    let coefficients = vec![0.5; 3 * basis.components()];
    let reconstruction = basis.reconstruct(&coefficients);
    let reconstruction = reconstruction.expect("all coefficients");
    for angles in ANGLES {
        let _ = reconstruction.brdf(&angles, 0.5);
        let _ = reconstruction.brdf_with_derivative(&angles);
        let _ = basis.look_up(angles.map(f64::from));
    }
}
