//! Damaged headers of recipes and bases: the error states the part.

use glimpse_core::error::Error;
use glimpse_core::file::{FileFormat, HEADER_BYTES};
use glimpse_core::model::linear::{Basis, format};
use glimpse_core::recipe::FORMAT;

use crate::recipe::complete;
use crate::recipes::{file, parse_error};

/// Checks each flipped bit, each length, and other versions.
fn check(format: &FileFormat, whole: &[u8], parse_error: fn(&[u8]) -> Error) {
    let [magic, version, length, checksum] = format.errors;
    let mut altered = whole.to_vec();
    for index in 0..whole.len() {
        let code = match index {
            0..4 => magic,
            4..6 => version,
            6..10 => length,
            _ => checksum,
        };
        for bit in 0..8 {
            altered[index] ^= 1 << bit;
            assert_eq!(parse_error(&altered).code, code, "byte {index}, bit {bit}");
            altered[index] ^= 1 << bit;
        }
    }
    let of_length = |body: usize, found: usize| {
        let lengths = [HEADER_BYTES + body, found];
        Error::with(length, lengths.map(|length| length as u32))
    };
    let padded = [whole, &[0]].concat();
    for found in (0..whole.len()).chain([padded.len()]) {
        let expected = match found {
            0..4 => Error::new(magic),
            4..HEADER_BYTES => of_length(format.min_body_bytes, found),
            _ => of_length(whole.len() - HEADER_BYTES, found),
        };
        assert_eq!(parse_error(&padded[..found]), expected);
    }
    let others = (0..8).chain([u16::MAX]);
    for other in others.filter(|other| *other != format.version) {
        for body in [&whole[HEADER_BYTES..], &[]] {
            let error = parse_error(&file(&format.magic, other, body));
            assert_eq!(error, Error::with(version, [other.into(), 0]));
        }
    }
}

#[test]
fn errors_state_part_of_header() {
    for contents in complete() {
        check(&FORMAT, &contents.write(), parse_error);
    }
    let basis = crate::basis::Contents::synthetic([3, 3, 2], 2).bytes();
    assert!(Basis::parse(&basis).is_ok());
    check(&format::FORMAT, &basis, |bytes| {
        Basis::parse(bytes).expect_err("a damaged basis")
    });
}
