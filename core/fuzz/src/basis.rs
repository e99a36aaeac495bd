//! A compact basis from untrusted bytes: it is rejected, or it evaluates to a valid BRDF.
//!
//! An input contains a byte, eight numbers, and a basis. If the first byte is odd, length and checksum of the basis are
//! corrected before it is parsed, because random bytes almost never have the right checksum.

use arbitrary::{Arbitrary, Unstructured};
use glimpse_core::file::HEADER_BYTES;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::Basis;
use glimpse_core::model::linear::format::FORMAT;

/// Checks one input.
pub fn check(input: &[u8]) {
    let input = <(u8, [f32; 8], &[u8])>::arbitrary_take_rest(Unstructured::new(input));
    let Ok((correct_header, numbers, bytes)) = input else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if correct_header & 1 == 1 && bytes.len() >= HEADER_BYTES {
        let header = FORMAT.header(&bytes[HEADER_BYTES..]);
        bytes[6..HEADER_BYTES].copy_from_slice(&header[6..]);
    }
    let Ok(basis) = Basis::parse(&bytes) else {
        return;
    };
    assert!(basis.components() > 0);
    let [hx, hz, dx, dy, dz, coefficients @ ..] = &numbers;
    // The lists of red, green and blue have 3, 8 and 0 coefficients.
    for at in [[*hx, *hz, *dx, *dy, *dz], [0.0, 1.0, 0.0, 0.0, 1.0]] {
        let at = HalfDifference::from_array(at);
        if let Some(brdf) = basis.brdf([coefficients, &numbers, &[]], &at) {
            assert!(brdf.iter().all(|value| value.is_finite() && *value >= 0.0));
        }
    }
}
