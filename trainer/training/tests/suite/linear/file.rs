//! The file of a basis: round trip, and what is said of one that does not serve.

use std::collections::BTreeSet;
use std::fs;

use glimpse_materials::basis::{Basis, BasisError, Grid};

use super::basis;

const HEADER: usize = 24;

/// Why a file with these bytes cannot be the basis with this checksum.
fn refusal(bytes: &[u8], checksum: u32) -> &'static str {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    fs::write(&path, bytes).expect("it is written");
    let error = Basis::read(&path, checksum).expect_err("it is refused");
    let BasisError::Damaged {
        path: angles_from_array,
        what,
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!(angles_from_array, path);
    what
}

#[test]
fn what_is_written_is_read_again() {
    let basis = basis(3);
    let bytes = basis.to_bytes();
    assert_eq!(bytes.len(), HEADER + 4 * Grid::LEN * (2 + 3));
    assert_eq!(&bytes[..4], b"GLMB");
    let found = Basis::from_bytes(&bytes).expect("it is a basis");
    assert_eq!(found, basis);
    assert_eq!(found.to_bytes(), bytes);
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    fs::write(&path, &bytes).expect("it is written");
    let found = Basis::read(&path, Basis::checksum(&bytes)).expect("it is a basis");
    assert_eq!(found, basis);
}

#[test]
fn the_checksum_is_the_common_one() {
    assert_eq!(Basis::checksum(b"123456789"), 0xcbf4_3926);
    // CRC-32 of nothing is 0, by which recipes say that they have no basis.
    assert_eq!(Basis::checksum(b""), 1);
}

#[test]
fn a_missing_file_is_named() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for path in [
        scratch.path().join("none.basis"),
        scratch.path().to_path_buf(),
    ] {
        let error = Basis::read(&path, 1).expect_err("there is none");
        assert!(matches!(&error, BasisError::Read { path: actual, .. } if *actual == path));
    }
}

#[test]
fn another_recipe_s_and_damaged_files_are_refused() {
    let bytes = basis(3).to_bytes();
    let checksum = Basis::checksum(&bytes);
    let other = basis(4).to_bytes();
    assert_ne!(Basis::checksum(&other), checksum);
    let another = refusal(&other, checksum);
    for place in [0, 4, 20, HEADER, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x10;
        assert_eq!(refusal(&damaged, checksum), another);
    }
    for length in [0, 3, HEADER - 1, HEADER, bytes.len() - 4, bytes.len() - 1] {
        assert_eq!(refusal(&bytes[..length], checksum), another);
    }
    let longer = [&bytes[..], &[0; 4]].concat();
    assert_eq!(refusal(&longer, checksum), another);
}

/// Whatever a header counts, no more is held than the file has. Each cause has a message of its own.
#[test]
fn bytes_with_a_fitting_checksum_have_to_be_a_basis_too() {
    let bytes = basis(3).to_bytes();
    let refused = |bytes: &[u8]| {
        let what = Basis::from_bytes(bytes).expect_err("it is refused");
        assert_eq!(refusal(bytes, Basis::checksum(bytes)), what);
        what
    };
    let wrong_length = refused(&bytes[..1]);
    let too_short = refused(b"");
    for length in [2, 3, HEADER - 1, bytes.len() - 1] {
        assert_eq!(refused(&bytes[..length]), wrong_length);
    }
    for length in [4, HEADER - 4] {
        assert_eq!(refused(&bytes[..length]), too_short);
    }
    for length in [HEADER, HEADER + 4, bytes.len() - 4] {
        assert_eq!(refused(&bytes[..length]), wrong_length);
    }
    assert_eq!(refused(&[&bytes[..], &[0; 4]].concat()), wrong_length);
    let mut versions = (0..5).map(|word| {
        let mut other = bytes.clone();
        other[4 * word] ^= 1;
        refused(&other)
    });
    let version = versions.next().expect("a first word");
    assert!(versions.all(|what| what == version));
    for components in [1_u32, 2, 4, 1 << 16, 1 << 31, u32::MAX - 1, u32::MAX] {
        let mut other = bytes.clone();
        other[20..HEADER].copy_from_slice(&components.to_le_bytes());
        assert_eq!(refused(&other), wrong_length);
        assert_eq!(refused(&other[..HEADER]), wrong_length);
    }
    // A table of means and medians alone describes no material.
    let mut none = bytes[..HEADER + 4 * Grid::LEN * 2].to_vec();
    none[20..HEADER].copy_from_slice(&0_u32.to_le_bytes());
    let causes = [
        wrong_length,
        too_short,
        version,
        refused(&none),
        refusal(&bytes, Basis::checksum(&bytes) ^ 1),
    ];
    let distinct: BTreeSet<_> = causes.into_iter().collect();
    assert_eq!(distinct.len(), causes.len(), "{causes:?}");
}
