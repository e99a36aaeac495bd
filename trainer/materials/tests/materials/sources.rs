//! Where materials come from, and what is said when they do not.

use std::fs;
use std::path::Path;

use glimpse_core::model::ParameterSet;
use glimpse_materials::{NeuralBrdf, Source, SourceError, write_merl};
use tempfile::TempDir;

use crate::common::assert_names;
use crate::rgl::{write_anisotropic, write_rgl, write_spectral};
use crate::{angles, network};

const ARRAYS: [(&str, &[u64]); 6] = [
    ("fc1", &[6, 21]),
    ("b1", &[21]),
    ("fc2", &[21, 21]),
    ("b2", &[21]),
    ("fc3", &[21, 3]),
    ("b3", &[3]),
];

/// A `.npy` file, format 1.0, written out by hand.
fn npy(kind: &str, shape: &[u64], fortran: bool, data: &[u8]) -> Vec<u8> {
    let shape: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let order = if fortran { "True" } else { "False" };
    let mut header =
        format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({shape}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend_from_slice(data);
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Writes a network's six files.
fn write_network(directory: &Path, name: &str, network: &NeuralBrdf) {
    for ((array, shape), run) in ARRAYS.into_iter().zip(network.parameters().runs()) {
        let file = directory.join(format!("{name}_{array}.npy"));
        fs::write(file, npy("<f4", shape, false, &floats(run))).expect("it is written");
    }
}

/// The names of the materials of a source that is read.
fn names(path: &Path) -> Vec<String> {
    load(path).expect("it is read")
}

/// The message about a source that is refused as damaged, by this file.
fn damage(source: &Path, file: &Path) -> String {
    match load(source) {
        Err(SourceError::Damaged { path, what }) if path == file => what,
        other => panic!("{other:?}"),
    }
}

fn scratch() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn load(path: &Path) -> Result<Vec<String>, SourceError> {
    let materials = Source(path.display().to_string()).load()?;
    Ok(materials
        .iter()
        .map(|each| each.name().to_owned())
        .collect())
}

#[test]
fn a_directory_is_read_sorted_and_other_files_are_passed_over() {
    let directory = scratch();
    let at = directory.path();
    write_network(at, "a_late-one", &network(1));
    write_network(at, "an-early-one", &network(2));
    write_merl(&at.join("a-table.binary"), &network(3)).expect("it is written");
    write_rgl(&at.join("a_measurement_rgb.bsdf"));
    for other in [
        "README.md",
        "x.npy",
        "fc1.npy",
        "x_fc4.npy",
        ".bsdf",
        ".binary.swp",
    ] {
        fs::write(at.join(other), b"something else").expect("it is written");
    }
    fs::create_dir(at.join("deeper.binary")).expect("it is made");
    let expected = ["a-table", "a_late-one", "a_measurement_rgb", "an-early-one"];
    assert_eq!(names(at), expected);
}

#[test]
fn one_file_is_one_material_whichever_of_six_it_is() {
    let directory = scratch();
    let network = network(1);
    write_network(directory.path(), "green-felt", &network);
    for (array, _) in ARRAYS {
        let path = directory.path().join(format!("green-felt_{array}.npy"));
        assert_eq!(names(&path), ["green-felt"]);
        let read = NeuralBrdf::read(&path).expect("it is read");
        assert_eq!(read.parameters(), network.parameters());
    }
    let table = directory.path().join("green-felt.binary");
    write_merl(&table, &network).expect("it is written");
    assert_eq!(names(&table), ["green-felt"]);
    let measurement = directory.path().join("green-felt.bsdf");
    write_rgl(&measurement);
    assert_eq!(names(&measurement), ["green-felt"]);
}

#[test]
fn two_of_the_same_name_are_refused() {
    let directory = scratch();
    let at = directory.path();
    write_rgl(&at.join("felt.bsdf"));
    for (array, shape) in ARRAYS {
        let data = vec![0; 4 * shape.iter().product::<u64>() as usize];
        fs::write(
            at.join(format!("felt_{array}.npy")),
            npy("<f4", shape, false, &data),
        )
        .expect("it is written");
    }
    let assert_twice = |expected: [&str; 2]| match load(at) {
        Err(SourceError::Twice {
            name,
            first,
            second,
        }) => {
            assert_eq!(name, "felt");
            assert_eq!([first, second], expected.map(|file| at.join(file)));
        }
        other => panic!("{other:?}"),
    };
    assert_twice(["felt.bsdf", "felt_fc1.npy"]);
    fs::write(at.join("felt.binary"), b"not even looked at").expect("it is written");
    assert_twice(["felt.binary", "felt.bsdf"]);
}

#[test]
fn measurements_of_other_kinds_are_not_left_out_in_silence() {
    let directory = scratch();
    let at = directory.path();
    write_rgl(&at.join("a_rgb.bsdf"));
    let brushed = at.join("brushed_rgb.bsdf");
    write_anisotropic(&brushed);
    for path in [at, &brushed] {
        assert_names(&damage(path, &brushed), &["3", "phi_i"]);
    }
    fs::remove_file(&brushed).expect("it can be removed");
    let spectral = at.join("a_spec.bsdf");
    write_spectral(&spectral);
    for path in [at, &spectral] {
        assert_names(&damage(path, &spectral), &["RGB"]);
    }
}

#[test]
fn procedural_sets_are_counted_and_seeded() {
    // Name and a value of each.
    let set = |text: &str| -> Vec<(String, [f32; 3])> {
        let source: Source = text.parse().expect("it parses");
        let materials = source.load().expect("it loads");
        let each = materials.iter();
        each.map(|each| (each.name().to_owned(), each.brdf(angles([0.2, 0.7, 1.5]))))
            .collect()
    };
    assert_eq!(set("procedural").len(), 100);
    assert_eq!(set("procedural:7"), set("procedural")[..7]);
    assert_eq!(set("procedural:7:0"), set("procedural:7"));
    assert_ne!(set("procedural:7:1"), set("procedural:7"));
    assert_eq!(
        "procedural:7:1"
            .parse::<Source>()
            .expect("it parses")
            .to_string(),
        "procedural:7:1"
    );
}

#[test]
fn misspelt_procedural_sets_are_refused_when_parsed_and_when_loaded() {
    for text in [
        "procedural:",
        "procedural:0",
        "procedural:100001",
        "procedural:-1",
        "procedural:many",
        "procedural:3:",
        "procedural:3:x",
        "procedural:3:4:5",
    ] {
        for error in [text.parse::<Source>().err(), load(Path::new(text)).err()] {
            assert!(
                matches!(&error, Some(SourceError::Procedural(named)) if named == text),
                "{text}: {error:?}"
            );
        }
    }
}

#[test]
fn what_is_not_there_is_said_so() {
    for path in ["nowhere/at-all", "procedural-10", "procedurals"] {
        assert_eq!(
            path.parse::<Source>()
                .map(|source| source.0)
                .ok()
                .as_deref(),
            Some(path)
        );
        let found = load(Path::new(path));
        assert!(
            matches!(&found, Err(SourceError::Missing(named)) if named == Path::new(path)),
            "{found:?}"
        );
    }
}

#[test]
fn what_is_no_material_is_said_so() {
    let directory = scratch();
    let at = directory.path();
    let assert_empty = || {
        let found = load(at);
        assert!(
            matches!(&found, Err(SourceError::Empty(path)) if path == at),
            "{found:?}"
        );
    };
    assert_empty();
    let notes = at.join("notes.txt");
    fs::write(&notes, b"notes").expect("it is written");
    assert_empty();
    let found = load(&notes);
    assert!(
        matches!(&found, Err(SourceError::Unknown(path)) if *path == notes),
        "{found:?}"
    );
}

#[test]
fn a_damaged_network_is_refused_by_its_file() {
    let directory = scratch();
    write_network(directory.path(), "felt", &network(1));
    let file = directory.path().join("felt_b2.npy");
    let good = fs::read(&file).expect("it is there");
    let mut values = [0.5_f32; 21];
    values[4] = f32::NAN;
    let short = good[..good.len() - 1].to_vec();
    for (bytes, named) in [
        (
            npy("<f4", &[21], false, &floats(&values)),
            &["4", "NaN"][..],
        ),
        (
            npy("<f4", &[22], false, &floats(&[0.5; 22])),
            &["[21]", "[22]"],
        ),
        (
            npy("<f4", &[3, 7], false, &floats(&[0.5; 21])),
            &["[21]", "[3, 7]"],
        ),
        (
            npy("<f4", &[21], true, &floats(&[0.5; 21])),
            &["[21]", "C", "Fortran"],
        ),
        (npy("<i4", &[21], false, &[0; 84]), &["32"]),
        (npy("<f8", &[21], false, &[0; 168]), &["32"]),
        (short, &["[21]", "211", "212"]),
        (b"not NumPy at all".to_vec(), &["NumPy"]),
        (Vec::new(), &["NumPy"]),
    ] {
        fs::write(&file, bytes).expect("it is written");
        assert_names(&damage(directory.path(), &file), named);
    }

    fs::remove_file(&file).expect("it can be removed");
    damage(directory.path(), &file);
    // A set that lacks its first file is not overlooked.
    fs::write(&file, good).expect("it is written");
    let first = directory.path().join("felt_fc1.npy");
    fs::remove_file(&first).expect("it can be removed");
    damage(directory.path(), &first);
}
