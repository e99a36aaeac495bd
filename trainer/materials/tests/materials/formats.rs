//! What is written is read again: how much is lost, and which format a file has whatever it is called.

use std::f32::consts::{FRAC_PI_2, PI};
use std::fs;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ParameterSet;
use glimpse_materials::loss::loss_between;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{
    Material, NeuralBrdf, Procedural, RglMeasurement, to_merl, to_rgl, write_merl,
};

use crate::common::assert_names;
use crate::folder::{Folder, damage, load};
use crate::rgl::isotropic;
use crate::{Made, network};

/// Reads the bytes of a tensor file.
fn measurement(bytes: &[u8]) -> RglMeasurement {
    let folder = Folder::new();
    let path = folder.write("written_rgb.bsdf", bytes);
    RglMeasurement::read(&path).expect("it is read")
}

/// The message about a file with this name and these bytes.
fn refusal(name: &str, bytes: &[u8]) -> String {
    let folder = Folder::new();
    let path = folder.write(name, bytes);
    damage(load(&path), &path).expect("it is refused")
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
    let mut values = values.map(f64::from_le_bytes);
    assert!(values.all(|value| [0.0, -1.0].contains(&value)));
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
    let folder = Folder::new();
    let network = network(4);
    folder.write_network("felt", &network);
    let read = NeuralBrdf::read(&folder.at("felt_fc1.npy")).expect("it is read");
    let [read, written] = [&read, &network].map(|network| network.parameters().iter());
    assert!(read.map(|x| x.to_bits()).eq(written.map(|x| x.to_bits())));
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
    let folder = Folder::new();
    write_merl(&folder.at("table"), &Made(|_| [0.1; 3])).expect("it is written");
    folder.write("tensors", isotropic());
    for (file, names) in [
        ("table", ["a.binary", "b.bsdf", "c.table", "d"]),
        ("tensors", ["e.binary", "f.bsdf", "g.tensors", "h"]),
    ] {
        for name in names {
            fs::copy(folder.at(file), folder.at(name)).expect("it is copied");
            let read = load(&folder.at(name)).expect("it is read");
            let without_ending = name.trim_end_matches(".binary").trim_end_matches(".bsdf");
            assert_eq!(read[0].name(), without_ending);
        }
    }
    // Of a directory only what ends like a material is read.
    let names = load(folder.path()).expect("they are read");
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
    ] {
        assert_names(&refusal(name, bytes), named);
    }
}

#[test]
fn nothing_is_allocated_on_a_header_s_word() {
    // 4 GB of header, and 2^62 values.
    let long = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'";
    let many = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': \
                 (4611686018427387904,), }";
    for bytes in [&long[..], many] {
        refusal("felt_fc1.npy", bytes);
    }
}
