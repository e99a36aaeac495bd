//! The file of a basis: round trip, and what is said of one that does not serve.

use std::fs;

use glimpse_trainer::linear::{Basis, BasisError, Grid};

use super::basis;

const HEADER: usize = 24;

/// Why a file with these bytes cannot be the basis with this checksum.
fn refusal(bytes: &[u8], checksum: u32) -> &'static str {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("some.basis");
    fs::write(&path, bytes).expect("it is written");
    let error = Basis::read(&path, checksum).expect_err("it is refused");
    let BasisError::Damaged { path: named, what } = &error else {
        panic!("{error}");
    };
    assert_eq!(*named, path);
    let message = error.to_string();
    assert!(
        message.contains("some.basis") && message.contains(what),
        "{message}"
    );
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
        assert!(matches!(&error, BasisError::Read { path: named, .. } if *named == path));
        assert!(error.to_string().contains(&path.display().to_string()));
    }
}

#[test]
fn another_recipe_s_and_damaged_files_are_refused() {
    let bytes = basis(3).to_bytes();
    let checksum = Basis::checksum(&bytes);
    let other = basis(4).to_bytes();
    assert_ne!(Basis::checksum(&other), checksum);
    assert_eq!(refusal(&other, checksum), "its checksum is another");
    for place in [0, 4, 20, HEADER, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x10;
        assert_eq!(refusal(&damaged, checksum), "its checksum is another");
    }
    for length in [0, 3, HEADER - 1, HEADER, bytes.len() - 4, bytes.len() - 1] {
        assert_eq!(
            refusal(&bytes[..length], checksum),
            "its checksum is another"
        );
    }
    let longer = [&bytes[..], &[0; 4]].concat();
    assert_eq!(refusal(&longer, checksum), "its checksum is another");
}

/// Whatever a header counts, no more is held than the file has.
#[test]
fn bytes_with_a_fitting_checksum_have_to_be_a_basis_too() {
    let bytes = basis(3).to_bytes();
    let refused = |bytes: &[u8]| {
        let what = Basis::from_bytes(bytes).expect_err("it is refused");
        assert_eq!(refusal(bytes, Basis::checksum(bytes)), what);
        what
    };
    for length in [1, 2, 3, HEADER - 1, bytes.len() - 1] {
        assert_eq!(refused(&bytes[..length]), "its length is wrong");
    }
    for length in [0, 4, HEADER - 4] {
        assert_eq!(refused(&bytes[..length]), "it is too short");
    }
    for length in [HEADER, HEADER + 4, bytes.len() - 4] {
        assert_eq!(refused(&bytes[..length]), "its length is wrong");
    }
    assert_eq!(
        refused(&[&bytes[..], &[0; 4]].concat()),
        "its length is wrong"
    );
    for word in 0..5 {
        let mut other = bytes.clone();
        other[4 * word] ^= 1;
        assert_eq!(refused(&other), "it is of another version");
    }
    for components in [1_u32, 2, 4, 1 << 16, 1 << 31, u32::MAX - 1, u32::MAX] {
        let mut other = bytes.clone();
        other[20..HEADER].copy_from_slice(&components.to_le_bytes());
        assert_eq!(refused(&other), "its length is wrong");
        assert_eq!(refused(&other[..HEADER]), "its length is wrong");
    }
    // A table of means and medians alone describes no material.
    let mut none = bytes[..HEADER + 4 * Grid::LEN * 2].to_vec();
    none[20..HEADER].copy_from_slice(&0_u32.to_le_bytes());
    assert_eq!(refused(&none), "it has no components");
}
