//! Damaged files of every format: each is rejected with one message that names the file, the defect and the remedy.

use std::collections::BTreeMap;
use std::path::Path;

use glimpse_core::model::ModelKind;
use glimpse_materials::{
    FittedBrdf, FittedMaterial, Material, NeuralBrdf, PabSet, RglMeasurement, SourceError, to_nbrdf,
};

use crate::common::assert_names;
use crate::folder::{self, Folder};
use crate::rgl::isotropic;
use crate::{angles, network};

/// A file's name, its valid bytes, and its reader.
struct Case {
    name: &'static str,
    bytes: Vec<u8>,
    read: fn(&Path) -> Result<(), SourceError>,
}

const PAB: &str = "#sample_name \"card\"\n#colorimetry: CIE-XYZ\n#format: theta phi BRDF\n#intheta 30\n\
                   #inphi 0\n#set_intheta 30\n#values 3\n0 0 0.1 0.11 0.12\n10 0 0.1 0.12 0.13\n\
                   10 90 0.13 0.14 0.15\n";

fn cases() -> Vec<Case> {
    let count = ModelKind::Phong.parameters();
    let values = vec![0.25; count.expect("the model has parameters")];
    let fitted = FittedBrdf::new(ModelKind::Phong, values, None);
    let fitted = fitted.expect("the number of values is right");
    let fitted = FittedMaterial::new("felt".into(), fitted);
    let metadata = BTreeMap::<&str, &str>::new();
    let json = fitted
        .expect("the values are finite")
        .to_json(None, metadata);
    let [_, (_, b1), ..] = to_nbrdf(network(1).parameters());
    let json = json.expect("the material is serialized").into_bytes();
    let case = |name, bytes, read| Case { name, bytes, read };
    vec![
        case("felt.bsdf", isotropic(), |path| {
            let brdf = RglMeasurement::read(path)?.brdf(angles([0.2, 0.3, 0.4]));
            assert!(brdf.iter().all(|value| value.is_finite()), "{brdf:?}");
            Ok(())
        }),
        case("felt_b1.npy", b1, |path| NeuralBrdf::read(path).map(|_| ())),
        case("felt.txt", PAB.into(), |path| {
            PabSet::read(path).map(|_| ())
        }),
        case("material.json", json, |path| {
            FittedMaterial::read(path).map(|_| ())
        }),
    ]
}

/// Returns the defect that reading these bytes reports, or None if they can be read.
///
/// A network consists of several files; only the one of the case has these bytes, and the others are valid.
fn reported_defect(case: &Case, bytes: &[u8]) -> Option<String> {
    let folder = Folder::new();
    if case.name.ends_with(".npy") {
        folder.write_network("felt", &network(1));
    }
    let path = folder.write(case.name, bytes);
    let defect = folder::reported_defect((case.read)(&path), &path)?;
    assert!(!defect.contains(char::is_control), "{defect:?}");
    Some(defect)
}

#[test]
fn rejects_truncated_and_extended_files() {
    for case in &cases() {
        let (name, valid) = (case.name, &case.bytes[..]);
        assert_eq!(reported_defect(case, valid), None, "{name}");
        // The line break at the end of JSON is optional.
        let optional = usize::from(name == "material.json");
        for length in 0..valid.len() - optional {
            let defect = reported_defect(case, &valid[..length]);
            assert!(
                defect.is_some(),
                "{name}: {length} of {} bytes are read",
                valid.len()
            );
        }
        for suffix in [&b"0"[..], b"0\n", &[0; 8]] {
            let defect = reported_defect(case, &[valid, suffix].concat());
            assert!(
                defect.is_some(),
                "{name}: a file with {suffix:?} appended is read"
            );
        }
    }
}

#[test]
fn changed_bytes_do_not_panic() {
    for case in &cases() {
        let (mut read, mut rejected) = (0, 0);
        for index in 0..case.bytes.len().min(600) {
            for change in [0x01, 0x20, 0x80, 0xff] {
                let mut other = case.bytes.clone();
                other[index] ^= change;
                match reported_defect(case, &other) {
                    None => read += 1,
                    Some(_) => rejected += 1,
                }
            }
        }
        println!("{}: {rejected} rejected, {read} read", case.name);
        assert!(
            rejected > 100 && read > 0,
            "{}: {rejected}, {read}",
            case.name
        );
    }
}

#[test]
fn error_names_the_invalid_field_and_value() {
    let cases = cases();
    let case = |name: &str| {
        let case = cases.iter().find(|case| case.name == name);
        case.expect("the case exists")
    };
    let changed_array = |from: &str, to: &str| {
        let bytes = &case("felt_b1.npy").bytes;
        let mut windows = bytes[..128].windows(from.len());
        let at = windows.position(|window| window == from.as_bytes());
        let at = at.expect("the header contains the text");
        let mut other = bytes.clone();
        other.splice(at..at + from.len(), to.bytes());
        other
    };
    let changed_text = |from: &str, to: &str| PAB.replace(from, to).into_bytes();
    let changed_json = |from: &str, to: &str| {
        let text = String::from_utf8_lossy(&case("material.json").bytes).replace(from, to);
        text.into_bytes()
    };
    let mut big_endian = case("felt.bsdf").bytes.clone();
    big_endian[14..18].reverse();
    let long = "x".repeat(100_000);
    for (name, bytes, words) in [
        (
            "felt_b1.npy",
            changed_array("<f4", "<f8"),
            &["<f4", "descr", "<f8"][..],
        ),
        (
            "felt_b1.npy",
            changed_array("False", "True "),
            &["C", "[21]", "Fortran"],
        ),
        (
            "felt_b1.npy",
            changed_array("(21,)", "(7,3)"),
            &["[21]", "[7, 3]"],
        ),
        ("felt_b1.npy", changed_array("(21,)", "((((("), &["6", "2"]),
        ("felt.bsdf", big_endian, &["8"]),
        (
            "felt.txt",
            changed_text("#values 3", "#values 4"),
            &["3", "#values", "4"],
        ),
        (
            "felt.txt",
            changed_text("#set_intheta 30", "#set_intheta 30 60"),
            &["intheta", "60"],
        ),
        (
            "felt.txt",
            changed_text("0.1 0.11", "0,1 0,11"),
            &["8", "0,1"],
        ),
        (
            "felt.txt",
            changed_text("0.1 0.11", "inf 0.11"),
            &["8", "inf"],
        ),
        (
            "felt.txt",
            changed_text("card", "../card"),
            &["sample_name", "../card"],
        ),
        ("felt.txt", changed_text("CIE-XYZ", &long), &["colorimetry"]),
        (
            "material.json",
            changed_json("\"version\": 1", "\"version\": 2, \"values\": {}"),
            &["2"],
        ),
        ("material.json", changed_json("phong", &long), &["model"]),
        (
            "material.json",
            changed_json("felt", "\\u001b[2J"),
            &["name", "\\u{1b}[2J"],
        ),
        (
            "material.json",
            changed_json("0.25", "1e300"),
            &["0", "values"],
        ),
    ] {
        let defect = reported_defect(case(name), &bytes).expect("the file is rejected");
        assert_names(&defect, words);
        assert!(defect.len() < 500, "{} bytes of {name}", defect.len());
    }
}

/// An untrusted file may refer to a device that never ends.
#[cfg(unix)]
#[test]
fn rejects_a_device_as_basis() {
    let text = r#"{"format": "glimpse-material", "version": 1, "name": "felt", "model": "linear",
        "basis": {"file": "/dev/zero", "checksum": "00000001"}, "values": [1, 1, 1]}"#;
    let folder = Folder::new();
    let path = folder.write("material.json", text);
    let error = FittedMaterial::read(&path).expect_err("the file is rejected");
    assert_names(&error.to_string(), &["/dev/zero"]);
}
