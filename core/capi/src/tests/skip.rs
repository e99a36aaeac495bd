//! Tests of skipped samples, in a scan and in a driver.

use core::ptr::null_mut;

use super::driver::{begin as begin_driver, poll};
use super::fit::finish;
use super::{AlignedMemory, MASKED, RECIPES, begin, reading};
use crate::driver::{glimpse_driver_finish_early, glimpse_driver_record, glimpse_driver_skip};
use crate::fit::glimpse_fit_begin;
use crate::scan::{
    glimpse_scan, glimpse_scan_finish_early, glimpse_scan_next, glimpse_scan_reading,
    glimpse_scan_record, glimpse_scan_skip,
};
use crate::status::glimpse_status as Status;
use crate::types::{glimpse_action_kind as Kind, glimpse_host, glimpse_reading, glimpse_sample};

fn next(scan: *mut glimpse_scan) -> Option<u16> {
    let mut sample = glimpse_sample::default();
    match unsafe { glimpse_scan_next(scan, 0, &raw mut sample) } {
        Status::Ok => Some(sample.index),
        status => {
            assert_eq!(status, Status::NonePending);
            None
        }
    }
}

fn record(scan: *mut glimpse_scan, index: u16) {
    let reading = reading(index);
    let status = unsafe { glimpse_scan_record(scan, index, &raw const reading, null_mut()) };
    assert_eq!(status, Status::Ok);
}

#[test]
fn tolerant_recipe_can_finish_early() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, MASKED);
    let mut found = glimpse_reading::default();
    unsafe {
        assert_eq!(glimpse_scan_skip(scan, 16), Status::ReadingIndex);
        record(scan, 0);
        assert_eq!(glimpse_scan_skip(scan, 0), Status::Ok);
        let status = glimpse_scan_reading(scan, 0, &raw mut found);
        assert_eq!(status, Status::NotRead);
        assert_eq!(next(scan), Some(1));
        // A reading undoes the skip.
        record(scan, 0);
        let status = glimpse_scan_reading(scan, 0, &raw mut found);
        assert_eq!((status, found), (Status::Ok, reading(0)));
        for index in 1..5 {
            record(scan, index);
        }
        assert_eq!(glimpse_scan_finish_early(scan), Status::Ok);
        assert_eq!(next(scan), None);
        assert_eq!(glimpse_fit_begin(scan), Status::Ok);
    }
    let (status, residual) = finish(scan);
    assert_eq!((status, residual.implausible), (Status::Ok, 0));
}

#[test]
fn other_recipes_need_every_reading() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[0]);
    unsafe {
        assert_eq!(glimpse_scan_skip(scan, 0), Status::ReadingRequired);
        assert_eq!(glimpse_scan_finish_early(scan), Status::ReadingRequired);
    }
    assert_eq!(next(scan), Some(0));
    let mut memory = AlignedMemory::for_driver();
    let driver = begin_driver(&mut memory, RECIPES[0], glimpse_host::Absent, &[]);
    unsafe {
        assert_eq!(glimpse_driver_skip(driver, 0), Status::ReadingRequired);
        let status = glimpse_driver_finish_early(driver);
        assert_eq!(status, Status::ReadingRequired);
    }
    let driver = begin_driver(&mut memory, b"", glimpse_host::Absent, &[]);
    unsafe {
        assert_eq!(glimpse_driver_skip(driver, 0), Status::NoScan);
        assert_eq!(glimpse_driver_finish_early(driver), Status::NoScan);
    }
}

#[test]
fn driver_skips_and_finishes_early() {
    let mut memory = AlignedMemory::for_driver();
    let driver = begin_driver(&mut memory, MASKED, glimpse_host::Absent, &[]);
    let mut measured = std::vec::Vec::new();
    loop {
        let action = poll(driver);
        match (action.kind, action.index) {
            (Kind::Measure, 1) => {
                assert_eq!(unsafe { glimpse_driver_skip(driver, 1) }, Status::Ok);
            }
            (Kind::Measure, 5) => {
                assert_eq!(unsafe { glimpse_driver_finish_early(driver) }, Status::Ok);
            }
            (Kind::Measure, index) => {
                measured.push(index);
                let reading = reading(index);
                let status = unsafe { glimpse_driver_record(driver, index, &raw const reading) };
                assert_eq!(status, Status::Ok);
            }
            (Kind::Finished, _) => break,
            (Kind::Failed, _) => panic!("{:?}", action.failure),
            _ => {}
        }
    }
    assert_eq!(measured, [0, 2, 3, 4]);
}
