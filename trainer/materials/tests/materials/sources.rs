//! Sources of materials, and their errors.

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use glimpse_core::checksum::crc_32;
use glimpse_materials::{Format, Procedural, Source, SourceError, Sources, digest, to_npy};

use crate::folder::{Folder, assert_defect, load};
use crate::rgl::isotropic;
use crate::{FunctionMaterial, angles, network};

/// Returns the names of a source's materials.
fn names(path: &Path) -> Result<Vec<String>, SourceError> {
    let materials = load(path)?;
    let names = materials.iter().map(|material| material.name().to_owned());
    Ok(names.collect())
}

#[test]
fn directory_is_sorted_and_other_files_are_ignored() {
    let folder = Folder::new();
    folder.write_network("a_late-one", &network(1));
    folder.write_network("an-early-one", &network(2));
    folder.write_table("a-table.binary", &network(3));
    folder.write("a_measurement_rgb.bsdf", isotropic());
    // RGL publishes each material in RGB and as spectra.
    for other in [
        "a_measurement_spec.bsdf",
        "README.md",
        "x.npy",
        "fc1.npy",
        "x_fc4.npy",
        ".bsdf",
        ".binary.swp",
    ] {
        folder.write(other, b"other content");
    }
    fs::create_dir(folder.at("deeper.binary")).expect("the directory is created");
    let expected = ["a-table", "a_late-one", "a_measurement_rgb", "an-early-one"];
    assert_eq!(
        names(folder.path()).expect("the directory is read"),
        expected
    );
    let source = Source(folder.path().display().to_string());
    let skipped = source.skipped_entries().expect("the directory is listed");
    let expected = ".bsdf a_measurement_spec.bsdf deeper.binary fc1.npy x.npy x_fc4.npy";
    assert_eq!(skipped.join(" "), expected);
}

#[test]
fn any_file_of_a_material_loads_it() {
    let folder = Folder::new();
    let network = network(1);
    folder.write_network("green-felt", &network);
    let endings = Format::Nbrdf.properties().written.iter();
    let paths = endings.map(|ending| folder.at(&format!("green-felt{ending}")));
    let mut paths: Vec<_> = paths.collect();
    paths.push(folder.write_table("green-felt.binary", &network));
    paths.push(folder.write("green-felt.bsdf", isotropic()));
    for path in &paths[..6] {
        let read = load(path).expect("the file is read")[0].network();
        assert_eq!(read.as_ref(), Some(network.parameters()));
    }
    for path in paths {
        assert_eq!(names(&path).expect("the file is read"), ["green-felt"]);
    }
}

#[test]
fn rejects_duplicate_names() {
    let folder = Folder::new();
    folder.write("felt.bsdf", isotropic());
    folder.write_network("felt", &network(1));
    let assert_duplicate = |expected: [&str; 2]| match names(folder.path()) {
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
    assert_duplicate(["felt.bsdf", "felt_fc1.npy"]);
    folder.write("felt.binary", b"not read");
    assert_duplicate(["felt.binary", "felt.bsdf"]);
}

/// The expected bytes are those of `numpy.save` for an array of ones.
#[test]
fn arrays_equal_those_of_numpy() {
    for (shape, stated) in [(&[3][..], "(3,)"), (&[1, 3], "(1, 3)")] {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {stated}, }}");
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        expected.extend(format!("{header:117}\n").as_bytes());
        expected.extend([0, 0, 0x80, 0x3f].repeat(3));
        assert_eq!(to_npy(shape, &[1.0; 3]), expected);
    }
}

/// Returns a `.npy` file of a matrix, or of a vector of one column: the `type_code` of NumPy, its order, and its shape.
fn npy(values: &[f32], [rows, columns]: [usize; 2], type_code: &str, fortran: bool) -> Vec<u8> {
    let (order, shape) = match (fortran, columns) {
        (true, 1) => ("True", format!("({rows},)")),
        (true, _) => ("True", format!("({rows}, {columns})")),
        (false, _) => ("False", format!("({rows}, {columns})")),
    };
    let header =
        format!("{{'descr': '{type_code}', 'fortran_order': {order}, 'shape': {shape}, }}");
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{header:117}\n").as_bytes());
    for position in 0..rows * columns {
        let index = match fortran {
            true => position % rows * columns + position / rows,
            false => position,
        };
        let value = values[index];
        match type_code {
            "<f4" => bytes.extend(value.to_le_bytes()),
            ">f4" => bytes.extend(value.to_be_bytes()),
            "<f8" => bytes.extend(f64::from(value).to_le_bytes()),
            _ => bytes.extend(f64::from(value).to_be_bytes()),
        }
    }
    bytes
}

#[test]
fn network_is_read_in_any_order_type_and_orientation() {
    const SHAPES: [(&str, [usize; 2]); 6] = [
        ("fc1", [6, 21]),
        ("b1", [21, 1]),
        ("fc2", [21, 21]),
        ("b2", [21, 1]),
        ("fc3", [21, 3]),
        ("b3", [3, 1]),
    ];
    let network = network(1);
    let folder = Folder::new();
    let write = |type_code: &str, fortran: bool, is_transposed: &dyn Fn(&str) -> bool| {
        let mut rest = &network.parameters()[..];
        for (name, [rows, columns]) in SHAPES {
            let (values, after) = rest.split_at(rows * columns);
            let bytes = match is_transposed(name) && columns > 1 {
                true => {
                    let element = |index: usize| values[index % rows * columns + index / rows];
                    let values: Vec<f32> = (0..rows * columns).map(element).collect();
                    npy(&values, [columns, rows], type_code, fortran)
                }
                false => npy(values, [rows, columns], type_code, fortran),
            };
            folder.write(&format!("felt_{name}.npy"), bytes);
            rest = after;
        }
        load(&folder.at("felt_b2.npy")).map(|networks| networks[0].network())
    };
    for type_code in ["<f4", ">f4", "<f8", ">f8"] {
        for (fortran, transposed) in [(false, false), (true, false), (false, true), (true, true)] {
            let read = write(type_code, fortran, &|_| transposed).expect("the network is read");
            assert_eq!(
                read.as_ref(),
                Some(network.parameters()),
                "{type_code} {fortran} {transposed}"
            );
        }
    }
    // The orientation of the square matrix is unknown.
    let mixed = write("<f4", false, &|name| name == "fc1");
    assert!(mixed.is_err());
    let file = folder.at("felt_fc3.npy");
    assert_defect(&file, &file, "21, (3, 21) fc1");
}

#[test]
fn procedural_sets_follow_count_and_seed() {
    // The name and one value of each material.
    let set = |text: &str| -> Vec<(String, [f32; 3])> {
        let source: Source = text.parse().expect("the source is valid");
        let materials = source.load().expect("the source is loaded");
        let materials = materials.iter();
        materials
            .map(|material| {
                let brdf = material.at_angles(angles([0.2, 0.7, 1.5]));
                (material.name().to_owned(), brdf)
            })
            .collect()
    };
    assert_eq!(set("procedural").len(), 100);
    assert_eq!(set("procedural:7"), set("procedural")[..7]);
    assert_eq!(set("procedural:7:0"), set("procedural:7"));
    assert_ne!(set("procedural:7:1"), set("procedural:7"));
    let source: Source = "procedural:7:1".parse().expect("the source is valid");
    assert_eq!(source.to_string(), "procedural:7:1");
}

#[test]
fn parsing_and_loading_reject_invalid_procedural_sets() {
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
                matches!(&error, Some(SourceError::InvalidProcedural(source)) if source == text),
                "{text}: {error:?}"
            );
        }
    }
}

#[test]
fn missing_path_is_an_error() {
    for path in ["nowhere/at-all", "procedural-10", "procedurals"] {
        let source: Source = path.parse().expect("the source is valid");
        assert_eq!(source.0, path);
        let result = names(Path::new(path));
        assert!(
            matches!(&result, Err(SourceError::NotFound(missing)) if missing == Path::new(path)),
            "{result:?}"
        );
    }
}

#[test]
fn directory_or_file_without_material_is_an_error() {
    let folder = Folder::new();
    let assert_empty = || {
        let result = names(folder.path());
        assert!(
            matches!(&result, Err(SourceError::Empty(path)) if path == folder.path()),
            "{result:?}"
        );
    };
    assert_empty();
    let notes = folder.write("notes.txt", b"notes");
    assert_empty();
    assert_defect(&notes, &notes, "notes");
}

/// Every file of a network is needed, including the first one.
#[test]
fn error_names_the_missing_or_damaged_file_of_a_network() {
    let folder = Folder::new();
    folder.write_network("felt", &network(1));
    let hidden = folder.at("hidden");
    for missing in ["felt_b2.npy", "felt_fc1.npy"] {
        let file = folder.at(missing);
        fs::rename(&file, &hidden).expect("the file is renamed");
        assert_defect(folder.path(), &file, "_b3");
        fs::write(&file, "not NumPy").expect("the file is written");
        assert_defect(folder.path(), &file, "NumPy");
        fs::rename(&hidden, &file).expect("the file is renamed");
    }
}

fn sources(texts: &[&str]) -> Vec<Source> {
    texts.iter().map(|text| Source((*text).into())).collect()
}

#[test]
fn shares_are_in_proportion() {
    let list = sources(&["procedural:30:1", "procedural:10:2"]);
    for (shares, expected) in [(&[][..], 0.75), (&[1.0, 3.0][..], 0.25)] {
        let sources = Sources::new(list.clone(), shares).expect("valid shares");
        let (materials, source_shares) = sources.load().expect("distinct names");
        assert_eq!(materials.len(), 40);
        assert_eq!(
            [source_shares[0].materials, source_shares[1].materials],
            [30, 10]
        );
        assert_eq!(
            [source_shares[0].share, source_shares[1].share],
            [expected, 1.0 - expected]
        );
    }
    let sources = Sources::new(list, &[1.0, 3.0]).expect("valid shares");
    assert_eq!(
        sources.label(),
        "procedural:30:1 (0.250) and procedural:10:2 (0.750)"
    );
}

#[test]
fn rejects_wrong_shares_and_duplicate_names() {
    let list = sources(&["procedural:3", "procedural:4"]);
    for shares in [
        &[1.0][..],
        &[1.0, 1.0, 1.0],
        &[1.0, 0.0],
        &[1.0, f32::NAN],
        &[f32::MAX, f32::MAX],
    ] {
        Sources::new(list.clone(), shares).expect_err("invalid shares");
    }
    let sources = Sources::new(list, &[]).expect("no shares");
    let error = sources.load().err().expect("duplicate names");
    assert!(
        matches!(&error, SourceError::DuplicateName { name, .. } if name.starts_with("procedural-000")),
        "{error}"
    );
}

#[test]
fn digest_depends_on_the_brdf_alone() {
    let constant = |value: f32| digest(&FunctionMaterial(move |_| [value; 3]));
    // 64 directions of three f32 each: 768 zero bytes.
    let zeros = crc_32(&[0; 768]);
    assert_eq!(constant(0.0), zeros);
    assert_ne!(constant(f32::from_bits(1)), zeros);

    let set = Procedural::set(50, 0);
    let digests: HashSet<u32> = set.iter().map(|material| digest(material)).collect();
    assert_eq!(digests.len(), 50);
    assert_eq!(digest(&set[7]), digest(&Procedural::set(8, 0)[7]));
    assert_ne!(digest(&set[7]), digest(&Procedural::set(8, 1)[7]));
}
