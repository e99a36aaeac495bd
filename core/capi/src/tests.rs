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

mod drivers;
mod scans;
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
use crate::types::{glimpse_config, glimpse_saved};

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
/// A recipe whose training materials are unlike these readings.
pub(crate) const UNLIKE: &[u8] = include_bytes!("../../../trainer/recipes/timed/phong-n16.recipe");
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
    saved: Option<&glimpse_saved>,
) -> (glimpse_status, *mut glimpse_driver) {
    let mut driver = null_mut();
    let (pointer, bytes) = (memory.pointer(), memory.bytes);
    let (recipe, count) = (recipe.as_ptr(), recipe.len());
    let saved = saved.map_or(null(), core::ptr::from_ref);
    let status = unsafe {
        glimpse_driver_begin(
            pointer,
            bytes,
            recipe,
            count,
            config,
            saved,
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

/// Random numbers of a linear congruential generator.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Returns an integer below `end`.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
        (self.0 >> 33) % end
    }

    /// Returns a number from `low` to `high`.
    pub(crate) fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.below(1 << 20) as f32 / (1 << 20) as f32
    }

    /// Returns a reading. One of ten is invalid, and one of ten saturated.
    pub(crate) fn reading(&mut self, index: u16) -> Reading {
        let mut reading = reading(index);
        match self.below(10) {
            0 => reading.brdf[1] = [f32::NAN, -2.0, f32::INFINITY][self.below(3) as usize],
            1 => reading.saturated = true,
            _ => reading.brdf[2] += self.within(-0.1, 0.01),
        }
        reading
    }
}
