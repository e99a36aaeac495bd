//! Where materials come from, and what is said when they do not.

use std::fs;
use std::path::Path;

use glimpse_core::model::Neural;
use glimpse_materials::{NeuralBrdf, Source, SourceError, write_merl};

use crate::common::assert_names;
use crate::folder::{Folder, damage, load};
use crate::rgl::{anisotropic, isotropic, spectral};
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
fn npy(kind: &str, shape: &[u64], data: &[u8]) -> Vec<u8> {
    let shape: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    // With the ten bytes before it and the line's end a multiple of 64 bytes.
    let header = format!("{header:117}\n");
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

/// Writes a network's six files, written out by hand.
fn write_network(folder: &Folder, name: &str, network: &NeuralBrdf) {
    let mut rest = &network.parameters()[..];
    for ((array, shape), length) in ARRAYS.into_iter().zip(Neural::LAYERS) {
        let (layer, after) = rest.split_at(length);
        rest = after;
        let bytes = npy("<f4", shape, &floats(layer));
        folder.write(&format!("{name}_{array}.npy"), bytes);
    }
}

/// The names of the materials of a source.
fn names(path: &Path) -> Result<Vec<String>, SourceError> {
    let materials = load(path)?;
    let names = materials.iter().map(|each| each.name().to_owned());
    Ok(names.collect())
}

/// Asserts that a source is refused for a file that is damaged, and that the message names these.
fn assert_damaged(source: &Path, file: &Path, named: &[&str]) {
    let what = damage(load(source), file).expect("it is refused");
    assert_names(&what, named);
}

#[test]
fn a_directory_is_read_sorted_and_other_files_are_passed_over() {
    let folder = Folder::new();
    write_network(&folder, "a_late-one", &network(1));
    write_network(&folder, "an-early-one", &network(2));
    write_merl(&folder.at("a-table.binary"), &network(3)).expect("it is written");
    folder.write("a_measurement_rgb.bsdf", isotropic());
    for other in [
        "README.md",
        "x.npy",
        "fc1.npy",
        "x_fc4.npy",
        ".bsdf",
        ".binary.swp",
    ] {
        folder.write(other, b"something else");
    }
    fs::create_dir(folder.at("deeper.binary")).expect("it is made");
    let expected = ["a-table", "a_late-one", "a_measurement_rgb", "an-early-one"];
    assert_eq!(names(folder.path()).expect("they are read"), expected);
}

#[test]
fn one_file_is_one_material_whichever_of_six_it_is() {
    let folder = Folder::new();
    let network = network(1);
    write_network(&folder, "green-felt", &network);
    let mut paths = ARRAYS
        .map(|(array, _)| folder.at(&format!("green-felt_{array}.npy")))
        .to_vec();
    for path in &paths {
        let read = NeuralBrdf::read(path).expect("it is read");
        assert_eq!(read.parameters(), network.parameters());
    }
    paths.push(folder.at("green-felt.binary"));
    write_merl(&paths[6], &network).expect("it is written");
    paths.push(folder.write("green-felt.bsdf", isotropic()));
    for path in paths {
        assert_eq!(names(&path).expect("it is read"), ["green-felt"]);
    }
}

#[test]
fn two_of_the_same_name_are_refused() {
    let folder = Folder::new();
    folder.write("felt.bsdf", isotropic());
    write_network(&folder, "felt", &network(1));
    let assert_twice = |expected: [&str; 2]| match names(folder.path()) {
        Err(SourceError::DuplicateName {
            name,
            first,
            second,
        }) => {
            assert_eq!(name, "felt");
            assert_eq!([first, second], expected.map(|file| folder.at(file)));
        }
        other => panic!("{other:?}"),
    };
    assert_twice(["felt.bsdf", "felt_fc1.npy"]);
    folder.write("felt.binary", b"not even looked at");
    assert_twice(["felt.binary", "felt.bsdf"]);
}

#[test]
fn measurements_of_other_kinds_are_not_left_out_in_silence() {
    let folder = Folder::new();
    folder.write("a_rgb.bsdf", isotropic());
    for (file, bytes, named) in [
        ("brushed_rgb.bsdf", anisotropic(), &["3", "phi_i"][..]),
        ("a_spec.bsdf", spectral(), &["RGB"]),
    ] {
        let file = folder.write(file, bytes);
        for source in [folder.path(), &file] {
            assert_damaged(source, &file, named);
        }
        fs::remove_file(&file).expect("it can be removed");
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
    let source: Source = "procedural:7:1".parse().expect("it parses");
    assert_eq!(source.to_string(), "procedural:7:1");
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
        for error in [text.parse::<Source>().err(), names(Path::new(text)).err()] {
            assert!(
                matches!(&error, Some(SourceError::InvalidProcedural(named)) if named == text),
                "{text}: {error:?}"
            );
        }
    }
}

#[test]
fn what_is_not_there_is_said_so() {
    for path in ["nowhere/at-all", "procedural-10", "procedurals"] {
        let source: Source = path.parse().expect("it parses");
        assert_eq!(source.0, path);
        let found = names(Path::new(path));
        assert!(
            matches!(&found, Err(SourceError::NotFound(named)) if named == Path::new(path)),
            "{found:?}"
        );
    }
}

#[test]
fn what_is_no_material_is_said_so() {
    let folder = Folder::new();
    let assert_empty = || {
        let found = names(folder.path());
        assert!(
            matches!(&found, Err(SourceError::Empty(path)) if path == folder.path()),
            "{found:?}"
        );
    };
    assert_empty();
    let notes = folder.write("notes.txt", b"notes");
    assert_empty();
    let found = names(&notes);
    assert!(
        matches!(&found, Err(SourceError::UnknownFormat(path)) if *path == notes),
        "{found:?}"
    );
}

#[test]
fn a_damaged_network_is_refused_by_its_file() {
    let folder = Folder::new();
    write_network(&folder, "felt", &network(1));
    let file = folder.at("felt_b2.npy");
    let good = fs::read(&file).expect("it is there");
    let mut values = [0.5_f32; 21];
    values[4] = f32::NAN;
    let short = good[..good.len() - 1].to_vec();
    for (bytes, named) in [
        (npy("<f4", &[21], &floats(&values)), &["4", "NaN"][..]),
        (npy("<f4", &[22], &floats(&[0.5; 22])), &["[21]", "[22]"]),
        (npy("<i4", &[21], &[0; 84]), &["32"]),
        (short, &["[21]", "211", "212"]),
        (b"not NumPy at all".to_vec(), &["NumPy"]),
        (Vec::new(), &["NumPy"]),
    ] {
        fs::write(&file, bytes).expect("it is written");
        assert_damaged(folder.path(), &file, named);
    }

    // A set that lacks one of its files, also the first one, is not overlooked.
    fs::write(&file, good).expect("it is written");
    for missing in ["felt_b2.npy", "felt_fc1.npy"] {
        let hidden = folder.at("hidden");
        fs::rename(folder.at(missing), &hidden).expect("it can be renamed");
        assert_damaged(folder.path(), &folder.at(missing), &[]);
        fs::rename(&hidden, folder.at(missing)).expect("it can be renamed");
    }
}
