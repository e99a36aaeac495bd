//! The file of a basis: round trip, and errors of invalid files.

use std::collections::BTreeSet;
use std::fs;

use glimpse_materials::basis::{Basis, BasisError, Grid};

use super::basis;

/// The number of bytes before the table.
const HEADER_BYTES: usize = 24;

/// Reads a file with these bytes as the basis with this checksum, and returns the defect that the error states.
fn read_defect(bytes: &[u8], checksum: u32) -> &'static str {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    fs::write(&path, bytes).expect("the file is written");
    let error = Basis::read(&path, checksum).expect_err("the file is invalid");
    let BasisError::Damaged {
        path: error_path,
        defect,
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!(error_path, path);
    defect
}

#[test]
fn basis_file_round_trips() {
    let basis = basis(3);
    let bytes = basis.to_bytes();
    assert_eq!(bytes.len(), HEADER_BYTES + 4 * Grid::LEN * (2 + 3));
    assert_eq!(&bytes[..4], b"GLMB");
    let parsed = Basis::from_bytes(&bytes).expect("the bytes are a basis");
    assert_eq!(parsed, basis);
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    fs::write(&path, &bytes).expect("the file is written");
    let read = Basis::read(&path, Basis::checksum(&bytes)).expect("the file is a basis");
    assert_eq!(read, basis);
}

#[test]
fn checksum_is_crc32() {
    assert_eq!(Basis::checksum(b"123456789"), 0xcbf4_3926);
    // The CRC-32 of empty input is 0. The checksum is 1 instead, because 0 in a recipe means that it has no basis.
    assert_eq!(Basis::checksum(b""), 1);
}

#[test]
fn read_error_has_the_path_of_a_missing_file() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for path in [
        scratch.path().join("none.basis"),
        scratch.path().to_path_buf(),
    ] {
        let error = Basis::read(&path, 1).expect_err("the path is not a file");
        assert!(matches!(&error, BasisError::Read { path: actual, .. } if *actual == path));
    }
}

/// The counts in a header are checked against the length of the file. Each cause is reported as a distinct defect.
#[test]
fn rejects_invalid_files() {
    let bytes = basis(3).to_bytes();
    let checksum = Basis::checksum(&bytes);
    let altered = |at: usize, with: &[u8]| {
        let mut altered = bytes.clone();
        altered[at..at + with.len()].copy_from_slice(with);
        altered
    };
    let longer = [&bytes[..], &[0; 4]].concat();
    let cut = |length: usize| bytes[..length].to_vec();
    let components = |count: u32| altered(20, &count.to_le_bytes());
    // A table of means and medians without components is not a basis.
    let without_components = components(0)[..HEADER_BYTES + 4 * Grid::LEN * 2].to_vec();
    let with_own_checksum = [
        vec![cut(0), cut(4), cut(HEADER_BYTES - 4)],
        vec![
            cut(1),
            cut(HEADER_BYTES),
            cut(bytes.len() - 4),
            longer.clone(),
        ],
        (0..5)
            .map(|word| altered(4 * word, &[bytes[4 * word] ^ 1]))
            .collect(),
        [1, 4, 1 << 31, u32::MAX].map(components).into(),
        vec![without_components],
    ];
    let mut causes: Vec<&str> = Vec::new();
    for files in with_own_checksum {
        let defects = files.iter().map(|file| {
            let defect = Basis::from_bytes(file).expect_err("the bytes are invalid");
            assert_eq!(read_defect(file, Basis::checksum(file)), defect);
            defect
        });
        let distinct: BTreeSet<_> = defects.collect();
        assert_eq!(distinct.len(), 1, "{distinct:?}");
        causes.extend(distinct);
    }
    // Wrong counts are wrong lengths.
    assert_eq!(causes.remove(3), causes[1]);

    // Damaged files, and files of other recipes.
    let wrong_checksum = read_defect(&bytes, checksum ^ 1);
    let mut others = vec![basis(4).to_bytes(), longer, cut(0), cut(HEADER_BYTES)];
    others
        .extend([0, 4, 20, HEADER_BYTES, bytes.len() - 1].map(|at| altered(at, &[bytes[at] ^ 16])));
    for other in others {
        assert_eq!(read_defect(&other, checksum), wrong_checksum);
    }
    causes.push(wrong_checksum);
    let distinct: BTreeSet<_> = causes.iter().collect();
    assert_eq!(distinct.len(), 5, "{causes:?}");
}
