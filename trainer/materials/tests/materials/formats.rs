//! What is written is read again: how much is lost, and which format a file has whatever it is called.

use std::f32::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ParameterSet;
use glimpse_materials::loss::loss_between;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{
    Material, NeuralBrdf, Procedural, RglMeasurement, Source, SourceError, to_merl, to_nbrdf,
    to_rgl, write_merl,
};
use tempfile::TempDir;

use crate::common::assert_names;
use crate::rgl::write_rgl;
use crate::{Made, network};

fn scratch() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Reads the bytes of a tensor file.
fn measurement(bytes: &[u8]) -> RglMeasurement {
    let directory = scratch();
    let path = directory.path().join("written_rgb.bsdf");
    fs::write(&path, bytes).expect("it is written");
    RglMeasurement::read(&path).expect("it is read")
}

/// The error of a file with this name and these bytes; the file is the one that it names.
fn refusal(name: &str, bytes: &[u8]) -> SourceError {
    let directory = scratch();
    let path = directory.path().join(name);
    fs::write(&path, bytes).expect("it is written");
    let loaded = Source(path.display().to_string()).load();
    let error = loaded.err().expect("it is refused");
    let (SourceError::Damaged { path: named, .. } | SourceError::Unknown(named)) = &error else {
        panic!("{error}");
    };
    assert_eq!(*named, path);
    error
}

#[test]
fn a_tensor_file_is_the_brdf_but_for_little() {
    let mut losses = Vec::new();
    for material in &Procedural::set(12, 5) {
        let bytes = to_rgl("made up", material as &dyn Material).expect("it is finite");
        let read = measurement(&bytes);
        losses.push(loss_between(&read as &dyn Material, material));
        // What the loss hardly looks at: light that leaves along the surface, beside that which
        // leaves upwards.
        let (mut error, mut whole) = (0.0, 0.0);
        for angles in uniform_valid(20_000, 6) {
            let at = HalfDifference::from_angles(angles);
            if !(0.01..0.1).contains(&at.cos_theta_o()) {
                continue;
            }
            let [expected, found] = [material.brdf(angles), read.brdf(angles)];
            for (expected, found) in expected.iter().zip(found) {
                error += f64::from((found - expected).abs());
                whole += f64::from(*expected);
            }
        }
        assert!(
            error < 0.03 * whole,
            "{}: {error} of {whole}",
            material.name()
        );
    }
    let worst = losses.iter().copied().fold(0.0, f64::max);
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean < 2e-4 && worst < 6e-4, "{mean}, {losses:?}");
}

#[test]
fn nothing_is_black_in_every_format() {
    let black = Made(|_| [0.0; 3]);
    let black: &dyn Material = &black;
    let read = measurement(&to_rgl("black", black).expect("it is finite"));
    assert_eq!(loss_between(&read as &dyn Material, black), 0.0);
    let table = to_merl(black).expect("it is finite");
    let values = table[12..].as_chunks().0.iter().copied();
    assert!(
        values
            .map(f64::from_le_bytes)
            .all(|value| [0.0, -1.0].contains(&value))
    );
}

#[test]
fn what_is_not_finite_is_not_written() {
    let broken =
        Made(|angles: Angles<f32>| [0.1, 0.1, if angles.theta_h > 0.5 { f32::NAN } else { 0.1 }]);
    let broken: &dyn Material = &broken;
    for error in [
        to_rgl("", broken).expect_err("NaN"),
        to_merl(broken).expect_err("NaN"),
    ] {
        let [theta_h, ..] = error.angles;
        assert!(
            error.value.is_nan() && theta_h > 0.5_f32.to_degrees(),
            "{error}"
        );
    }
}

#[test]
fn a_network_is_the_same_to_the_bit() {
    let directory = scratch();
    let network = network(4);
    for (ending, bytes) in to_nbrdf(network.parameters()) {
        fs::write(directory.path().join(format!("felt{ending}")), bytes).expect("it is written");
    }
    let read = NeuralBrdf::read(&directory.path().join("felt_fc1.npy")).expect("it is read");
    let bits = |network: &NeuralBrdf| -> Vec<u32> {
        network
            .parameters()
            .iter()
            .map(|weight| weight.to_bits())
            .collect()
    };
    assert_eq!(bits(&read), bits(&network));
}

#[test]
fn nodes_of_a_table_are_the_brdf() {
    let material = Procedural::set(4, 9).remove(3);
    let table = to_merl(&material as &dyn Material).expect("it is finite");
    let (values, _) = table[12..].as_chunks();
    let scale = [1.0, 1.15, 1.66].map(|factor| factor / 1500.0);
    let mut above = 0;
    for h in (0..90).step_by(7) {
        for d in (0..90).step_by(5) {
            for phi in (0..180).step_by(11) {
                let root = h as f32 / 90.0;
                let angles = Angles {
                    theta_h: FRAC_PI_2 * root * root,
                    theta_d: (d as f32).to_radians(),
                    phi_d: phi as f32 * (PI / 180.0),
                };
                let at: HalfDifference<f32> = HalfDifference::from_angles(angles);
                if at.cos_theta_i().min(at.cos_theta_o()) < 1e-6 {
                    continue;
                }
                above += 1;
                let brdf = material.brdf(angles);
                for (channel, (expected, scale)) in brdf.iter().zip(scale).enumerate() {
                    let index = phi + 180 * (d + 90 * h) + channel * 90 * 90 * 180;
                    let found = f64::from_le_bytes(values[index]) * scale;
                    let error = (found / f64::from(*expected) - 1.0).abs();
                    // In f32, both angles and values.
                    assert!(error < 2e-6, "{found} and {expected} at {angles:?}");
                }
            }
        }
    }
    assert!(above > 1000, "{above} nodes");
}

#[test]
fn a_format_is_told_by_what_is_in_a_file() {
    let directory = scratch();
    let at = |name: &str| directory.path().join(name);
    write_merl(&at("table"), &Made(|_| [0.1; 3])).expect("it is written");
    write_rgl(&at("tensors"));
    let load = |path: &Path| Source(path.display().to_string()).load();
    for (file, names) in [
        ("table", ["a.binary", "b.bsdf", "c.table", "d"]),
        ("tensors", ["e.binary", "f.bsdf", "g.tensors", "h"]),
    ] {
        for name in names {
            fs::copy(at(file), at(name)).expect("it is copied");
            let read = load(&at(name)).expect("it is read");
            let stem = name.split('.').next().expect("there is one");
            let named = if name.contains(".binary") || name.contains(".bsdf") {
                stem
            } else {
                name
            };
            assert_eq!(read[0].name(), named);
        }
    }
    // Of a directory only what ends like a material is read.
    let names = load(directory.path()).expect("they are read");
    let names: Vec<&str> = names.iter().map(|each| each.name()).collect();
    assert_eq!(names, ["a", "b", "e", "f"]);
}

#[test]
fn other_dialects_are_named() {
    let zemax = b"# a comment\r\n\r\nSource  Measured\r\nSymmetry  PlaneSymmetrical\r\n";
    for (name, bytes, named) in [
        ("a.bsdf", &b"SCATFUN\x01\0\0\0\0"[..], &["layerlab"][..]),
        ("a.bsdf", zemax, &["Zemax"]),
        (
            "a.bsdf",
            b"<?xml version=\"1.0\"?><WindowElement>",
            &["XML"],
        ),
        ("a.bsdf", b"\x89HDF\r\n\x1a\n", &["HDF5"]),
        ("a.bsdf", b"\x93NUMPY\x01\0", &["NumPy"]),
        ("a.bsdf", b"tensor", &[]),
        ("a.bsdf", b"", &[]),
        ("a.binary", b"SCATFUN\x01", &["layerlab"]),
        ("a.binary", b"\0\0\0\x5a\0\0\0\x5a\0\0\0\xb4", &[]),
        (
            "a.binary",
            b"\x5a\0\0\0\x5a\0\0\0\x68\x01\0\0",
            &["[90, 90, 360]"],
        ),
    ] {
        let error = refusal(name, bytes);
        assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
        assert_names(&error.to_string(), named);
    }
    let error = refusal("a.txt", b"notes");
    assert!(matches!(error, SourceError::Unknown(_)), "{error}");
}

#[test]
fn nothing_is_allocated_on_a_header_s_word() {
    // 4 GB of header, and 2^62 values.
    let long = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'";
    let many = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': \
                 (4611686018427387904,), }";
    for bytes in [&long[..], many] {
        let error = refusal("felt_fc1.npy", bytes);
        assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
    }
    let directory = scratch();
    for (ending, bytes) in to_nbrdf(network(4).parameters()) {
        let mut bytes = bytes;
        bytes.resize(bytes.len() + 1_000_000, 0);
        fs::write(directory.path().join(format!("felt{ending}")), bytes).expect("it is written");
    }
    let error = NeuralBrdf::read(&directory.path().join("felt_b1.npy")).expect_err("too long");
    assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
}
