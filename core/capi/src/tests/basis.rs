//! Tests of Linear's basis.

use core::ptr::null_mut;
use std::vec::Vec;

use glimpse_core::error::ErrorCode;
use glimpse_core::model::linear::format::FORMAT;
use glimpse_core::recipe::Recipe;

use super::{AlignedMemory, PHONG, RECIPES, begin, reading};
use crate::fit::{glimpse_fit_advance, glimpse_fit_begin, glimpse_fit_finish, glimpse_fitted_brdf};
use crate::scan::{glimpse_scan_record, glimpse_scan_set_basis};
use crate::status::glimpse_status as Status;
use crate::types::glimpse_directions;

/// Returns a basis of eight nodes. Their means and components are 0, so the BRDF is 0 in all directions.
fn basis(basis_checksum: u32, components: usize) -> Vec<u8> {
    let mut body = basis_checksum.to_le_bytes().to_vec();
    for count in [components as u16, 2, 2, 2] {
        body.extend(count.to_le_bytes());
    }
    body.extend(1_f32.to_le_bytes().repeat(components + 1));
    body.resize(body.len() + 8 * (4 + components), 0);
    [&FORMAT.header(&body)[..], &body].concat()
}

#[test]
fn linear_brdf_requires_matching_basis() {
    let linear = RECIPES[3];
    let recipe = Recipe::parse(linear).unwrap();
    let (checksum, components) = (recipe.basis_checksum().unwrap(), recipe.values() / 3);
    let matching = basis(checksum, components);
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, linear);
    for index in 0..8 {
        let reading = reading(index).into();
        let status = unsafe { glimpse_scan_record(scan, index, &raw const reading, null_mut()) };
        assert_eq!(status, Status::Ok);
    }
    let found = unsafe {
        [
            glimpse_fit_begin(scan),
            glimpse_fit_advance(scan, u32::MAX, null_mut()),
            glimpse_fit_finish(scan),
        ]
    };
    assert_eq!(found, [Status::Ok; 3]);
    let mirror = glimpse_directions {
        incoming: [0.6, 0.0, 0.8],
        outgoing: [-0.6, 0.0, 0.8],
    };
    let mut brdf = [-1.0; 3];
    let mut set = |basis: &[u8]| unsafe {
        let status = glimpse_scan_set_basis(scan, basis.as_ptr(), basis.len());
        let evaluated = glimpse_fitted_brdf(scan, &raw const mirror, &raw mut brdf);
        (status, evaluated)
    };
    for (bytes, code) in [
        (b"no basis".as_slice(), ErrorCode::BasisMagic),
        (&matching[..40], ErrorCode::BasisLength),
        (&basis(checksum ^ 1, components), ErrorCode::Basis),
    ] {
        assert_eq!(set(bytes), (code.into(), Status::NoBasis));
    }
    // The fit is unchanged.
    assert_eq!(set(&matching), (Status::Ok, Status::Ok));
    assert_eq!(brdf, [0.0; 3]);
}

#[test]
fn other_models_reject_basis() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, PHONG);
    let basis = basis(0, 5);
    let status = unsafe { glimpse_scan_set_basis(scan, basis.as_ptr(), basis.len()) };
    assert_eq!(status, ErrorCode::Basis.into());
}
