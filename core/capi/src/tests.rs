//! Tests of the C functions, called as from C.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::undocumented_unsafe_blocks,
    clippy::unwrap_used
)]

mod basis;
mod calls;
mod header;
mod sizes;
mod texts;

use core::ffi::c_void;
use core::ptr::{null, null_mut};
use std::boxed::Box;
use std::vec;

use glimpse_core::gonio::Reading;
use glimpse_core::recipe::memory_words;

use crate::driver::glimpse_driver_begin;
use crate::handle::{DRIVER_BYTES, SCAN_BYTES, glimpse_driver, glimpse_scan};
use crate::scan::glimpse_scan_begin;
use crate::status::glimpse_status;
use crate::types::glimpse_config;

/// Recipes: first one with a descent or a solve for each model, then one with a completion for each model.
pub(crate) const RECIPES: [&[u8]; 8] = [
    include_bytes!("../../../trainer/recipes/paper/phong-n8.recipe"),
    include_bytes!("../../../trainer/recipes/paper/cook-torrance-n8.recipe"),
    include_bytes!("../../../trainer/recipes/paper/neural-n8.recipe"),
    include_bytes!("../../../trainer/recipes/paper/linear-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/phong-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/cook-torrance-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/neural-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/linear-n8.recipe"),
];
pub(crate) const PHONG: &[u8] = RECIPES[0];
/// A recipe of 16 samples that tolerates missing readings, and bounds the loss without them.
pub(crate) const MASKED: &[u8] = include_bytes!("../../../trainer/recipes/masked/phong-n16.recipe");
/// Memory of the largest of these recipes, in words.
pub(crate) const WORDS: usize = memory_words(&RECIPES);
const _: () = assert!(memory_words(&[MASKED]) <= WORDS);

/// The caller's memory: aligned, and filled with a pattern.
pub(crate) struct AlignedMemory {
    words: Box<[u64]>,
    pub(crate) bytes: usize,
}

impl AlignedMemory {
    pub(crate) fn new(bytes: usize) -> Self {
        let words = vec![0xA5A5_5A5A_C3C3_3C3C; bytes.div_ceil(8)].into_boxed_slice();
        Self { words, bytes }
    }

    pub(crate) fn for_scan() -> Self {
        Self::new(SCAN_BYTES + 4 * WORDS)
    }

    pub(crate) fn for_driver() -> Self {
        Self::new(DRIVER_BYTES + 4 * WORDS)
    }

    pub(crate) fn pointer(&mut self) -> *mut c_void {
        self.words.as_mut_ptr().cast()
    }
}

/// Begins a scan. Returns the status and the scan.
pub(crate) fn begin(
    memory: &mut AlignedMemory,
    recipe: &[u8],
) -> (glimpse_status, *mut glimpse_scan) {
    let mut scan = null_mut();
    let (pointer, bytes) = (memory.pointer(), memory.bytes);
    let (recipe, count) = (recipe.as_ptr(), recipe.len());
    let status = unsafe { glimpse_scan_begin(pointer, bytes, recipe, count, &raw mut scan) };
    assert_eq!(status == glimpse_status::Ok, !scan.is_null());
    (status, scan)
}

/// Begins a driver. Returns the status and the driver.
pub(crate) fn begin_driver(
    memory: &mut AlignedMemory,
    recipe: &[u8],
    config: &glimpse_config,
) -> (glimpse_status, *mut glimpse_driver) {
    let mut driver = null_mut();
    let (pointer, bytes) = (memory.pointer(), memory.bytes);
    let (recipe, count) = (recipe.as_ptr(), recipe.len());
    let status = unsafe {
        glimpse_driver_begin(
            pointer,
            bytes,
            recipe,
            count,
            config,
            null(),
            &raw mut driver,
        )
    };
    assert_eq!(status == glimpse_status::Ok, !driver.is_null());
    (status, driver)
}

/// Returns a reading that differs between samples.
pub(crate) fn reading(index: u16) -> Reading {
    let value = 0.05 + 0.02 * f32::from(index % 7);
    Reading::new([value, 0.8 * value, 0.5 * value])
}
