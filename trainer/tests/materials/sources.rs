//! Where materials come from, and what is said when they do not.

use std::fs;
use std::path::Path;

use glimpse_core::model::ParameterSet;
use glimpse_trainer::material::{NeuralBrdf, Source, write_merl};
use tempfile::TempDir;

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

fn scratch() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn load(path: &Path) -> Result<Vec<String>, String> {
    let materials = Source(path.display().to_string()).load();
    let materials = materials.map_err(|error| error.to_string())?;
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
    let names = ["a-table", "a_late-one", "a_measurement_rgb", "an-early-one"];
    assert_eq!(load(at), Ok(names.map(str::to_owned).to_vec()));
}

#[test]
fn one_file_is_one_material_whichever_of_six_it_is() {
    let directory = scratch();
    let network = network(1);
    write_network(directory.path(), "green-felt", &network);
    for (array, _) in ARRAYS {
        let path = directory.path().join(format!("green-felt_{array}.npy"));
        assert_eq!(load(&path), Ok(vec!["green-felt".to_owned()]));
        let read = NeuralBrdf::read(&path).expect("it is read");
        assert_eq!(read.parameters(), network.parameters());
    }
    let table = directory.path().join("green-felt.binary");
    write_merl(&table, &network).expect("it is written");
    assert_eq!(load(&table), Ok(vec!["green-felt".to_owned()]));
    let measurement = directory.path().join("green-felt.bsdf");
    write_rgl(&measurement);
    assert_eq!(load(&measurement), Ok(vec!["green-felt".to_owned()]));
}

#[test]
fn two_of_the_same_name_are_refused() {
    let directory = scratch();
    let at = directory.path();
    let path = at.display();
    write_rgl(&at.join("felt.bsdf"));
    for (array, shape) in ARRAYS {
        let data = vec![0; 4 * shape.iter().product::<u64>() as usize];
        fs::write(
            at.join(format!("felt_{array}.npy")),
            npy("<f4", shape, false, &data),
        )
        .expect("it is written");
    }
    let expected = |first: &str, second: &str| {
        Err(format!(
            "{path}/{first} and {path}/{second} are both named felt: rename one of them, or take \
             it away"
        ))
    };
    assert_eq!(load(at), expected("felt.bsdf", "felt_fc1.npy"));
    fs::write(at.join("felt.binary"), b"not even looked at").expect("it is written");
    assert_eq!(load(at), expected("felt.binary", "felt.bsdf"));
}

#[test]
fn measurements_of_other_kinds_are_not_left_out_in_silence() {
    let directory = scratch();
    let at = directory.path();
    write_rgl(&at.join("a_rgb.bsdf"));
    let brushed = at.join("brushed_rgb.bsdf");
    write_anisotropic(&brushed);
    for path in [at, &brushed] {
        let found = load(path).expect_err("it is anisotropic");
        let expected = format!(
            "{}: it is measured at 3 phi_i: it is anisotropic, and only isotropic materials (1 or \
             2 phi_i) are read; take it away",
            brushed.display()
        );
        assert_eq!(found, expected);
    }
    fs::remove_file(&brushed).expect("it can be removed");
    let spectral = at.join("a_spec.bsdf");
    write_spectral(&spectral);
    for path in [at, &spectral] {
        let found = load(path).expect_err("it is spectral");
        let expected = format!(
            "{}: it is a spectral measurement, and only RGB is read; take it away and put the \
             material's *_rgb.bsdf in its place",
            spectral.display()
        );
        assert_eq!(found, expected);
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
        let expected = format!(
            "`{text}` is not understood: write procedural, procedural:COUNT or \
             procedural:COUNT:SEED with a COUNT of 1 to 100000"
        );
        let parsed = text.parse::<Source>().map_err(|error| error.to_string());
        assert_eq!(parsed, Err(expected.clone()));
        assert_eq!(load(Path::new(text)), Err(expected));
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
        let expected = format!(
            "{path} does not exist: give a directory of materials, a single one (MERL *.binary, \
             RGL *_rgb.bsdf, NBRDF NAME_fc1.npy or a fitted material.json), or procedural[:COUNT[:SEED]]"
        );
        assert_eq!(load(Path::new(path)), Err(expected));
    }
}

#[test]
fn what_is_no_material_is_said_so() {
    let directory = scratch();
    let at = directory.path().display().to_string();
    let empty = format!(
        "{at} holds no materials: expected MERL (*.binary), RGL (*_rgb.bsdf) or NBRDF \
         (NAME_fc1.npy and its five siblings) in it, or the material.json of a fit"
    );
    assert_eq!(load(directory.path()), Err(empty.clone()));
    let notes = directory.path().join("notes.txt");
    fs::write(&notes, b"notes").expect("it is written");
    assert_eq!(load(directory.path()), Err(empty));
    let unknown = format!(
        "{at}/notes.txt is no material: expected MERL (*.binary), RGL (*_rgb.bsdf), NBRDF \
         (NAME_fc1.npy and its five siblings), a fitted material.json, a directory of those, or \
         procedural[:COUNT[:SEED]]"
    );
    assert_eq!(load(&notes), Err(unknown));
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
    for (bytes, beginning, remedy) in [
        (
            npy("<f4", &[21], false, &floats(&values)),
            "number 4 is NaN, and should be finite",
            "get it again",
        ),
        (
            npy("<f4", &[22], false, &floats(&[0.5; 22])),
            "it should hold an array of shape [21] in C order, not [22] in C order",
            "save it so with numpy.save",
        ),
        (
            npy("<f4", &[3, 7], false, &floats(&[0.5; 21])),
            "it should hold an array of shape [21] in C order, not [3, 7] in C order",
            "save it so with numpy.save",
        ),
        (
            npy("<f4", &[21], true, &floats(&[0.5; 21])),
            "it should hold an array of shape [21] in C order, not [21] in Fortran order",
            "save it so with numpy.save",
        ),
        (
            npy("<i4", &[21], false, &[0; 84]),
            "it should hold 32-bit floats (",
            "save it so with numpy.save",
        ),
        (
            npy("<f8", &[21], false, &[0; 168]),
            "it should hold 32-bit floats (",
            "save it so with numpy.save",
        ),
        (
            short,
            "it was cut short: it has 211 bytes where its header and an array of shape [21] have 212",
            "get it again",
        ),
        (
            b"not NumPy at all".to_vec(),
            "it is not a whole NumPy array (",
            "get it again",
        ),
        (
            Vec::new(),
            "it is not a whole NumPy array (",
            "get it again",
        ),
    ] {
        fs::write(&file, bytes).expect("it is written");
        let error = load(directory.path()).expect_err("it is damaged");
        let beginning = format!("{}: {beginning}", file.display());
        assert!(
            error.starts_with(&beginning) && error.ends_with(remedy),
            "{error}"
        );
    }

    fs::remove_file(&file).expect("it can be removed");
    let missing = format!(
        "{}: it is missing: an NBRDF material is six files, NAME_fc1.npy, _b1, _fc2, _b2, _fc3 \
         and _b3; put it beside the others",
        file.display()
    );
    assert_eq!(load(directory.path()), Err(missing.clone()));
    // A set that lacks its first file is not overlooked.
    fs::write(&file, good).expect("it is written");
    let first = directory.path().join("felt_fc1.npy");
    fs::remove_file(&first).expect("it can be removed");
    let missing = missing.replace(&*file.to_string_lossy(), &first.to_string_lossy());
    assert_eq!(load(directory.path()), Err(missing));
}
