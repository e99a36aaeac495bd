//! Tests of Linear's basis.

use core::ptr::null;
use std::vec::Vec;

use glimpse_core::model::linear::format::{MAGIC, VERSION, checksum_of};
use glimpse_core::recipe::Recipe;

use super::{AlignedMemory, MIRROR, RECIPES, begin, record_all};
use crate::fit::{glimpse_fit_advance, glimpse_fit_begin, glimpse_fit_finish, glimpse_fitted_brdf};
use crate::scan::{glimpse_scan_reading, glimpse_scan_set_basis};
use crate::status::glimpse_status as Status;
use crate::types::glimpse_reading;

const LINEAR: &[u8] = RECIPES[3];

/// Returns a basis of eight nodes. Their means and components are 0, so the BRDF is 0 in all directions.
fn basis(basis_checksum: u32, components: u16) -> Vec<u8> {
    let mut body = basis_checksum.to_le_bytes().to_vec();
    for count in [components, 2, 2, 2] {
        body.extend(count.to_le_bytes());
    }
    body.extend(1_f32.to_le_bytes());
    for _ in 0..components {
        body.extend(1_f32.to_le_bytes());
    }
    body.resize(body.len() + 8 * (4 + usize::from(components)), 0);
    let length = body.len() as u32;
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(length.to_le_bytes());
    bytes.extend(checksum_of(VERSION, length, &body).to_le_bytes());
    bytes.extend(body);
    bytes
}

#[test]
fn linear_brdf_requires_matching_basis() {
    let basis_checksum = Recipe::parse(LINEAR).unwrap().basis_checksum().unwrap();
    let components = super::scan::describe(LINEAR).values / 3;
    let matching = basis(basis_checksum, components);
    let mismatched = basis(basis_checksum ^ 1, components);

    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, LINEAR);
    assert_eq!(record_all(scan), 8);
    let set = |basis: &[u8]| unsafe { glimpse_scan_set_basis(scan, basis.as_ptr(), basis.len()) };
    let mut brdf = [-1.0; 3];
    unsafe {
        assert_eq!(glimpse_fit_begin(scan), Status::Ok);
        assert_eq!(
            glimpse_fit_advance(scan, u32::MAX, core::ptr::null_mut()),
            Status::Ok
        );
        assert_eq!(glimpse_fit_finish(scan, core::ptr::null_mut()), Status::Ok);
    }
    let evaluate =
        |brdf: &mut [f32; 3]| unsafe { glimpse_fitted_brdf(scan, &raw const MIRROR, brdf) };
    assert_eq!(evaluate(&mut brdf), Status::NoBasis);
    for (bytes, status) in [
        (b"no basis".as_slice(), Status::BasisMagic),
        (matching.get(..40).unwrap(), Status::BasisLength),
        (&mismatched, Status::Basis),
    ] {
        assert_eq!(set(bytes), status);
        assert_eq!(evaluate(&mut brdf), Status::NoBasis);
    }
    let status = unsafe { glimpse_scan_set_basis(scan, null(), 9) };
    assert_eq!(status, Status::Null);
    let status = unsafe { glimpse_scan_set_basis(core::ptr::null_mut(), matching.as_ptr(), 9) };
    assert_eq!(status, Status::Null);

    // Readings and fit are unchanged.
    assert_eq!(set(&matching), Status::Ok);
    assert_eq!(evaluate(&mut brdf), Status::Ok);
    assert_eq!(brdf, [0.0; 3]);
    let mut reading = glimpse_reading::default();
    let status = unsafe { glimpse_scan_reading(scan, 7, &raw mut reading) };
    assert_eq!(status, Status::Ok);
}

#[test]
fn other_models_reject_basis() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[0]);
    let basis = basis(0, 5);
    let status = unsafe { glimpse_scan_set_basis(scan, basis.as_ptr(), basis.len()) };
    assert_eq!(status, Status::Basis);
}
