//! The file of a basis: round trip, and errors of invalid files.

use std::collections::BTreeSet;
use std::fs;

use glimpse_materials::basis::{Basis, BasisError, Grid};

use super::basis;

/// The number of bytes before the table.
const HEADER: usize = 24;

/// Returns the error message of a file that is not the basis with this checksum.
fn read_error(bytes: &[u8], checksum: u32) -> &'static str {
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
    assert_eq!(bytes.len(), HEADER + 4 * Grid::LEN * (2 + 3));
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
    // The CRC-32 of empty input is 0, which in a recipe means that it has no basis.
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
    let wrong_checksum = read_error(&other, checksum);
    for position in [0, 4, 20, HEADER, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[position] ^= 0x10;
        assert_eq!(read_error(&damaged, checksum), wrong_checksum);
    }
    for length in [0, 3, HEADER - 1, HEADER, bytes.len() - 4, bytes.len() - 1] {
        assert_eq!(read_error(&bytes[..length], checksum), wrong_checksum);
    }
    let longer = [&bytes[..], &[0; 4]].concat();
    assert_eq!(read_error(&longer, checksum), wrong_checksum);
}

/// The counts in a header are checked against the length of the file. Each cause has a distinct message.
#[test]
fn rejects_invalid_bytes_with_matching_checksum() {
    let bytes = basis(3).to_bytes();
    let parse_error = |bytes: &[u8]| {
        let message = Basis::from_bytes(bytes).expect_err("the bytes are invalid");
        assert_eq!(read_error(bytes, Basis::checksum(bytes)), message);
        message
    };
    let wrong_length = parse_error(&bytes[..1]);
    let too_short = parse_error(b"");
    for length in [2, 3, HEADER - 1, bytes.len() - 1] {
        assert_eq!(parse_error(&bytes[..length]), wrong_length);
    }
    for length in [4, HEADER - 4] {
        assert_eq!(parse_error(&bytes[..length]), too_short);
    }
    for length in [HEADER, HEADER + 4, bytes.len() - 4] {
        assert_eq!(parse_error(&bytes[..length]), wrong_length);
    }
    assert_eq!(parse_error(&[&bytes[..], &[0; 4]].concat()), wrong_length);
    let mut versions = (0..5).map(|word| {
        let mut other = bytes.clone();
        other[4 * word] ^= 1;
        parse_error(&other)
    });
    let version = versions.next().expect("the iterator is not empty");
    assert!(versions.all(|message| message == version));
    for components in [1_u32, 2, 4, 1 << 16, 1 << 31, u32::MAX - 1, u32::MAX] {
        let mut other = bytes.clone();
        other[20..HEADER].copy_from_slice(&components.to_le_bytes());
        assert_eq!(parse_error(&other), wrong_length);
        assert_eq!(parse_error(&other[..HEADER]), wrong_length);
    }
    // A table of means and medians without components is not a basis.
    let mut none = bytes[..HEADER + 4 * Grid::LEN * 2].to_vec();
    none[20..HEADER].copy_from_slice(&0_u32.to_le_bytes());
    let causes = [
        wrong_length,
        too_short,
        version,
        parse_error(&none),
        read_error(&bytes, Basis::checksum(&bytes) ^ 1),
    ];
    let distinct: BTreeSet<_> = causes.into_iter().collect();
    assert_eq!(distinct.len(), causes.len(), "{causes:?}");
}
