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
    assert_eq!(parsed.to_bytes(), bytes);
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

#[test]
fn rejects_damaged_files_and_files_of_other_recipes() {
    let bytes = basis(3).to_bytes();
    let checksum = Basis::checksum(&bytes);
    let other = basis(4).to_bytes();
    assert_ne!(Basis::checksum(&other), checksum);
    let wrong_checksum = read_defect(&other, checksum);
    for position in [0, 4, 20, HEADER_BYTES, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[position] ^= 0x10;
        assert_eq!(read_defect(&damaged, checksum), wrong_checksum);
    }
    for length in [
        0,
        3,
        HEADER_BYTES - 1,
        HEADER_BYTES,
        bytes.len() - 4,
        bytes.len() - 1,
    ] {
        assert_eq!(read_defect(&bytes[..length], checksum), wrong_checksum);
    }
    let longer = [&bytes[..], &[0; 4]].concat();
    assert_eq!(read_defect(&longer, checksum), wrong_checksum);
}

/// The counts in a header are checked against the length of the file. Each cause is reported as a distinct defect.
#[test]
fn rejects_invalid_bytes_with_matching_checksum() {
    let bytes = basis(3).to_bytes();
    let parse_defect = |bytes: &[u8]| {
        let defect = Basis::from_bytes(bytes).expect_err("the bytes are invalid");
        assert_eq!(read_defect(bytes, Basis::checksum(bytes)), defect);
        defect
    };
    let wrong_length = parse_defect(&bytes[..1]);
    let too_short = parse_defect(b"");
    for length in [2, 3, HEADER_BYTES - 1, bytes.len() - 1] {
        assert_eq!(parse_defect(&bytes[..length]), wrong_length);
    }
    for length in [4, HEADER_BYTES - 4] {
        assert_eq!(parse_defect(&bytes[..length]), too_short);
    }
    for length in [HEADER_BYTES, HEADER_BYTES + 4, bytes.len() - 4] {
        assert_eq!(parse_defect(&bytes[..length]), wrong_length);
    }
    assert_eq!(parse_defect(&[&bytes[..], &[0; 4]].concat()), wrong_length);
    let mut header_defects = (0..5).map(|word| {
        let mut other = bytes.clone();
        other[4 * word] ^= 1;
        parse_defect(&other)
    });
    let wrong_header = header_defects.next().expect("the iterator is not empty");
    assert!(header_defects.all(|defect| defect == wrong_header));
    for components in [1_u32, 2, 4, 1 << 16, 1 << 31, u32::MAX - 1, u32::MAX] {
        let mut other = bytes.clone();
        other[20..HEADER_BYTES].copy_from_slice(&components.to_le_bytes());
        assert_eq!(parse_defect(&other), wrong_length);
        assert_eq!(parse_defect(&other[..HEADER_BYTES]), wrong_length);
    }
    // A table of means and medians without components is not a basis.
    let mut without_components = bytes[..HEADER_BYTES + 4 * Grid::LEN * 2].to_vec();
    without_components[20..HEADER_BYTES].copy_from_slice(&0_u32.to_le_bytes());
    let causes = [
        wrong_length,
        too_short,
        wrong_header,
        parse_defect(&without_components),
        read_defect(&bytes, Basis::checksum(&bytes) ^ 1),
    ];
    let distinct: BTreeSet<_> = causes.into_iter().collect();
    assert_eq!(distinct.len(), causes.len(), "{causes:?}");
}
