//! Tests of invalid arguments: each call returns a status, and no invalid pointer is dereferenced.

use core::ptr::{null, null_mut};
use std::vec::Vec;

use super::{AlignedMemory, MIRROR, NEURAL, RECIPES, begin};
use crate::driver::{
    glimpse_config_default, glimpse_driver, glimpse_driver_begin, glimpse_driver_bytes,
    glimpse_driver_fail, glimpse_driver_finish_early, glimpse_driver_outgoing, glimpse_driver_poll,
    glimpse_driver_poll_delay, glimpse_driver_receive, glimpse_driver_record,
    glimpse_driver_reject, glimpse_driver_restart, glimpse_driver_scan, glimpse_driver_sent,
    glimpse_driver_skip,
};
use crate::fit::{
    glimpse_fit_advance, glimpse_fit_begin, glimpse_fit_finish, glimpse_fitted_brdf,
    glimpse_fitted_is_unlike_training, glimpse_fitted_loss_bound, glimpse_fitted_predicted_loss,
    glimpse_fitted_residual, glimpse_fitted_values,
};
use crate::recipe::glimpse_recipe_describe;
use crate::scan::{
    glimpse_scan, glimpse_scan_begin, glimpse_scan_bytes, glimpse_scan_finish_early,
    glimpse_scan_next, glimpse_scan_reading, glimpse_scan_record, glimpse_scan_restart,
    glimpse_scan_skip,
};
use crate::status::glimpse_status as Status;
use crate::types::{
    glimpse_action_kind as Kind, glimpse_config, glimpse_host, glimpse_reading, glimpse_sample,
};

#[test]
fn rejects_unsuitable_memory() {
    let mut memory = AlignedMemory::for_scan();
    let (recipe, bytes) = (NEURAL.as_ptr(), NEURAL.len());
    let mut scan: *mut glimpse_scan = null_mut();
    let min_bytes = unsafe { glimpse_scan_bytes(recipe, bytes) };
    unsafe {
        let out = &raw mut scan;
        let pointer = memory.pointer();
        for (memory, memory_bytes, status) in [
            (null_mut(), min_bytes, Status::Null),
            (pointer.byte_add(1), min_bytes, Status::Misaligned),
            (pointer.byte_add(2), min_bytes, Status::Misaligned),
            (pointer, min_bytes - 1, Status::MemoryTooSmall),
            (pointer, 0, Status::MemoryTooSmall),
            (pointer, min_bytes, Status::Ok),
        ] {
            out.write(core::ptr::dangling_mut());
            let found = glimpse_scan_begin(memory, memory_bytes, recipe, bytes, out);
            assert_eq!(found, status);
            assert_eq!(scan.is_null(), status != Status::Ok);
        }
        let found = glimpse_scan_begin(pointer, min_bytes, recipe, bytes, null_mut());
        assert_eq!(found, Status::Null);
        let found = glimpse_scan_begin(pointer, min_bytes, null(), bytes, out);
        assert_eq!(found, Status::Null);
        let found = glimpse_scan_begin(pointer, min_bytes, recipe, usize::MAX, out);
        assert_eq!(found, Status::Length);
    }
}

#[test]
fn rejects_invalid_recipe_with_status() {
    let mut memory = AlignedMemory::for_scan();
    let cut = NEURAL.get(..NEURAL.len() - 1).unwrap();
    // A recipe may have any alignment.
    let unaligned = [b"-", NEURAL].concat();
    for (bytes, status) in [
        (b"".as_slice(), Status::RecipeMagic),
        (b"garbage, and more", Status::RecipeMagic),
        (cut, Status::RecipeLength),
        (unaligned.get(1..).unwrap(), Status::Ok),
    ] {
        assert_eq!(begin(&mut memory, bytes).0, status);
    }
    for index in 0..NEURAL.len() {
        let mut altered = Vec::from(NEURAL);
        altered[index] ^= 0x10;
        let expected = match index {
            0..4 => Status::RecipeMagic,
            4..6 => Status::RecipeVersion,
            6..10 => Status::RecipeLength,
            _ => Status::RecipeChecksum,
        };
        assert_eq!(begin(&mut memory, &altered).0, expected, "{index}");
    }
}

/// Each pointer in turn is null, or misaligned where alignment is required.
#[test]
fn rejects_null_and_misaligned_pointers() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[0]);
    let misaligned = scan.wrapping_byte_add(1);
    let mut reading = glimpse_reading::default();
    let mut sample = glimpse_sample::default();
    let (mut brdf, mut count) = ([0.0; 3], 0);
    let mut residual = core::mem::MaybeUninit::uninit();
    let mut unlike = core::mem::MaybeUninit::uninit();
    let misaligned_out = (&raw mut sample).wrapping_byte_add(1);
    unsafe {
        for (scan, expected) in [(null_mut(), Status::Null), (misaligned, Status::Misaligned)] {
            let found = [
                glimpse_scan_restart(scan),
                glimpse_scan_next(scan, 0, &raw mut sample),
                glimpse_scan_record(scan, 0, &raw const reading, null_mut()),
                glimpse_scan_reading(scan, 0, &raw mut reading),
                glimpse_scan_skip(scan, 0),
                glimpse_scan_finish_early(scan),
                glimpse_fit_begin(scan),
                glimpse_fit_advance(scan, 1, null_mut()),
                glimpse_fit_finish(scan, null_mut()),
                glimpse_fitted_brdf(scan, &raw const MIRROR, &raw mut brdf),
                glimpse_fitted_values(scan, brdf.as_mut_ptr(), 3, &raw mut count),
                glimpse_fitted_residual(scan, residual.as_mut_ptr()),
                glimpse_fitted_predicted_loss(scan, brdf.as_mut_ptr()),
                glimpse_fitted_loss_bound(scan, brdf.as_mut_ptr()),
                glimpse_fitted_is_unlike_training(scan, unlike.as_mut_ptr()),
            ];
            assert_eq!(found, [expected; 15]);
        }
        for (out, expected) in [
            (null_mut(), Status::Null),
            (misaligned_out, Status::Misaligned),
        ] {
            let found = [
                glimpse_scan_next(scan, 0, out),
                glimpse_scan_record(scan, 0, out.cast(), null_mut()),
                glimpse_scan_reading(scan, 0, out.cast()),
                glimpse_fitted_residual(scan, out.cast()),
                glimpse_fitted_predicted_loss(scan, out.cast()),
                glimpse_fitted_loss_bound(scan, out.cast()),
                glimpse_fitted_is_unlike_training(scan, out.cast()),
                glimpse_fitted_brdf(scan, &raw const MIRROR, out.cast()),
                glimpse_fitted_values(scan, null_mut(), 0, out.cast()),
            ];
            assert_eq!(found, [expected; 9]);
        }
        let described = glimpse_recipe_describe(NEURAL.as_ptr(), NEURAL.len(), null_mut());
        assert_eq!(described, Status::Null);
        let described = glimpse_recipe_describe(null(), 1, misaligned_out.cast());
        assert_eq!(described, Status::Misaligned);
    }
}

#[test]
fn driver_rejects_invalid_arguments() {
    let mut memory = AlignedMemory::for_driver();
    let config = glimpse_config_default(glimpse_host::Absent as i32);
    let unknown_host = glimpse_config_default(3);
    let mut driver = null_mut();
    let mut bytes = null();
    let mut count = 0;
    let mut scan = null();
    let mut delay_ms = 0;
    let reading = glimpse_reading::default();
    let mut action = core::mem::MaybeUninit::uninit();
    unsafe {
        let memory_bytes = glimpse_driver_bytes(NEURAL.as_ptr(), NEURAL.len());
        let mut begin = |config, saved, saved_count, out| {
            let (memory, recipe, length) = (memory.pointer(), NEURAL.as_ptr(), NEURAL.len());
            glimpse_driver_begin(
                memory,
                memory_bytes,
                recipe,
                length,
                config,
                saved,
                saved_count,
                out,
            )
        };
        let out = &raw mut driver;
        assert_eq!(begin(null(), null(), 0, out), Status::Null);
        assert_eq!(
            begin(&raw const unknown_host, null(), 0, out),
            Status::Argument
        );
        for set_invalid_limit in [
            |config: &mut glimpse_config| config.limits.max_theta_o = 0.0,
            |config: &mut glimpse_config| config.limits.max_theta_i = f32::NAN,
            |config: &mut glimpse_config| config.limits.min_separation = 4.0,
        ] {
            let mut invalid = config;
            set_invalid_limit(&mut invalid);
            // Limits are ignored unless the flag is set.
            assert_eq!(begin(&raw const invalid, null(), 0, out), Status::Ok);
            invalid.has_limits = 1;
            assert_eq!(begin(&raw const invalid, null(), 0, out), Status::Argument);
        }
        for target_loss in [-0.1, f32::NEG_INFINITY, f32::NAN] {
            let mut invalid = config;
            invalid.target_loss = target_loss;
            assert_eq!(begin(&raw const invalid, null(), 0, out), Status::Argument);
        }
        assert_eq!(begin(&raw const config, null(), 1, out), Status::Null);
        let status = begin(&raw const config, null(), 0, null_mut());
        assert_eq!(status, Status::Null);
        let dangling = core::ptr::dangling();
        let status = begin(&raw const config, dangling, usize::MAX, out);
        assert_eq!(status, Status::Length);
        assert!(driver.is_null());
        assert_eq!(begin(&raw const config, null(), 0, out), Status::Ok);

        let misaligned = driver.wrapping_byte_add(1);
        for (driver, expected) in [(null_mut(), Status::Null), (misaligned, Status::Misaligned)] {
            let found = [
                glimpse_driver_poll(driver, 1, action.as_mut_ptr()),
                glimpse_driver_receive(driver, null(), 0),
                glimpse_driver_outgoing(driver, &raw mut bytes, &raw mut count),
                glimpse_driver_sent(driver, 1),
                glimpse_driver_poll_delay(driver, 1, &raw mut delay_ms),
                glimpse_driver_record(driver, 0, &raw const reading),
                glimpse_driver_skip(driver, 0),
                glimpse_driver_finish_early(driver),
                glimpse_driver_fail(driver),
                glimpse_driver_reject(driver, null(), 0),
                glimpse_driver_restart(driver),
                glimpse_driver_scan(driver, &raw mut scan),
            ];
            assert_eq!(found, [expected; 12]);
        }
        let found = [
            glimpse_driver_poll(driver, 1, null_mut()),
            glimpse_driver_poll_delay(driver, 1, null_mut()),
            glimpse_driver_receive(driver, null(), 1),
            glimpse_driver_record(driver, 0, null()),
            glimpse_driver_scan(driver, null_mut()),
            glimpse_driver_outgoing(driver, null_mut(), &raw mut count),
        ];
        assert_eq!(found, [Status::Null; 6]);
        // A usable recipe cannot be rejected.
        let status = glimpse_driver_reject(driver, NEURAL.as_ptr(), NEURAL.len());
        assert_eq!(status, Status::Argument);
        let status = glimpse_driver_reject(driver, b"none".as_ptr(), 4);
        assert_eq!(status, Status::Ok);
        assert_failed(driver, Status::RecipeMagic);
    }
}

/// A driver rejects a valid recipe that needs more memory than the driver has.
#[test]
fn driver_rejects_recipe_larger_than_memory() {
    let [small, large] = [RECIPES[0], NEURAL];
    let mut memory = AlignedMemory::for_driver();
    let config = glimpse_config_default(glimpse_host::Absent as i32);
    let mut driver = null_mut();
    unsafe {
        let min_bytes = glimpse_driver_bytes(small.as_ptr(), small.len());
        let mut begin = |memory_bytes| {
            glimpse_driver_begin(
                memory.pointer(),
                memory_bytes,
                small.as_ptr(),
                small.len(),
                &raw const config,
                null(),
                0,
                &raw mut driver,
            )
        };
        assert_eq!(begin(100), Status::MemoryTooSmall);
        assert_eq!(begin(min_bytes), Status::Ok);
        // A usable recipe cannot be rejected.
        let status = glimpse_driver_reject(driver, small.as_ptr(), small.len());
        assert_eq!(status, Status::Argument);
        let status = glimpse_driver_reject(driver, large.as_ptr(), large.len());
        assert_eq!(status, Status::Ok);
        assert_failed(driver, Status::Memory);
    }
}

unsafe fn assert_failed(driver: *mut glimpse_driver, failure: Status) {
    let mut action = core::mem::MaybeUninit::uninit();
    unsafe {
        let status = glimpse_driver_poll(driver, 1, action.as_mut_ptr());
        assert_eq!(status, Status::Ok);
        let action = action.assume_init_ref();
        assert_eq!((action.kind, action.failure), (Kind::Failed, failure));
    }
}
