//! Tests of fits: the residual, and implausible materials.

use core::ptr::null_mut;
use std::vec;

use super::driver::{begin as begin_driver, poll};
use super::{AlignedMemory, MIRROR, RECIPES, begin};
use crate::driver::glimpse_driver_record;
use crate::fit::{
    glimpse_fit_advance, glimpse_fit_begin, glimpse_fit_finish, glimpse_fitted_brdf,
    glimpse_fitted_residual, glimpse_fitted_values,
};
use crate::scan::{glimpse_scan, glimpse_scan_record};
use crate::status::glimpse_status as Status;
use crate::types::{
    glimpse_action_kind as Kind, glimpse_host, glimpse_progress, glimpse_reading, glimpse_residual,
};

/// Advances a fit to its end and finishes it.
pub(super) fn finish(scan: *mut glimpse_scan) -> (Status, glimpse_residual) {
    let mut progress = glimpse_progress { done: 0, total: 1 };
    let mut residual = glimpse_residual::default();
    let status = unsafe {
        while progress.done < progress.total {
            let before = progress.done;
            assert_eq!(glimpse_fit_advance(scan, 3, &raw mut progress), Status::Ok);
            assert!(progress.done > before);
        }
        glimpse_fit_finish(scan, &raw mut residual)
    };
    (status, residual)
}

/// A broken sensor: a function from sample index to reading.
type Sensor = fn(u16) -> [f32; 3];

/// Broken sensors, and the status of a fit of their readings.
const BROKEN: [(Sensor, Status); 5] = [
    (|index| [-0.01 * f32::from(index + 1); 3], Status::Dark),
    (|_| [0.2; 3], Status::Repeated),
    (|index| [0.0, level(index), level(index)], Status::DeadRed),
    (|index| [level(index), level(index), 0.0], Status::DeadBlue),
    (|index| [9.0 * level(index) / 0.3; 3], Status::Albedo),
];

/// Returns a plausible BRDF value that differs between samples, sr^-1.
fn level(index: u16) -> f32 {
    0.25 + 0.005 * f32::from(index)
}

#[test]
fn implausible_material_has_status_and_result() {
    let mut memory = AlignedMemory::for_scan();
    for (broken, expected) in BROKEN {
        let (_, scan) = begin(&mut memory, RECIPES[0]);
        for index in 0..8 {
            let brdf = broken(index);
            let reading = glimpse_reading { brdf, saturated: 0 };
            let status =
                unsafe { glimpse_scan_record(scan, index, &raw const reading, null_mut()) };
            assert_eq!(status, Status::Ok);
        }
        assert_eq!(unsafe { glimpse_fit_begin(scan) }, Status::Ok);
        let (status, residual) = finish(scan);
        assert_eq!(status, expected);
        assert_eq!(residual.implausible, expected as i32);
        assert!(residual.mean > 0.0);
        let mut again = glimpse_residual::default();
        let (mut brdf, mut values, mut count) = ([f32::NAN; 3], vec![f32::NAN; 7], 0);
        let found = unsafe {
            [
                glimpse_fitted_residual(scan, &raw mut again),
                glimpse_fitted_brdf(scan, &raw const MIRROR, &raw mut brdf),
                glimpse_fitted_values(scan, values.as_mut_ptr(), 7, &raw mut count),
            ]
        };
        assert_eq!(found, [Status::Ok; 3]);
        assert_eq!((again, count), (residual, 7));
        assert!(brdf.iter().chain(&values).all(|value| value.is_finite()));
        // The fit has ended.
        let status = unsafe { glimpse_fit_finish(scan, null_mut()) };
        assert_eq!(status, Status::NoFit);
    }
}

#[test]
fn driver_reports_implausible_material() {
    let mut memory = AlignedMemory::for_driver();
    let driver = begin_driver(&mut memory, RECIPES[0], glimpse_host::Absent, &[]);
    let reading = glimpse_reading {
        brdf: [0.2; 3],
        saturated: 0,
    };
    loop {
        let action = poll(driver);
        match action.kind {
            Kind::Measure => {
                let status =
                    unsafe { glimpse_driver_record(driver, action.index, &raw const reading) };
                assert_eq!(status, Status::Ok);
            }
            Kind::Finished => {
                assert_eq!(action.residual.implausible, Status::Repeated as i32);
                break;
            }
            Kind::Failed => panic!("{:?}", action.failure),
            _ => {}
        }
    }
}
