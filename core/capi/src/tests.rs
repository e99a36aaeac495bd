//! Tests of the C functions, called as from C.

mod basis;
mod driver;
mod fit;
mod misuse;
mod scan;
mod sizes;
mod skip;
mod texts;

use core::ffi::c_void;
use core::ptr::null_mut;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use glimpse_core::recipe::memory_words;

use crate::configuration::{Fitter, driver_bytes, scan_bytes};
use crate::scan::{glimpse_scan, glimpse_scan_begin, glimpse_scan_next, glimpse_scan_record};
use crate::status::glimpse_status;
use crate::types::{glimpse_directions, glimpse_reading, glimpse_sample};

/// Recipes: first one with a descent or a solve for each model, then one with a completion for each model.
pub(crate) const RECIPES: [&[u8]; 8] = [
    include_bytes!("../../../trainer/recipes/phong-n8.recipe"),
    include_bytes!("../../../trainer/recipes/cook-torrance-n8.recipe"),
    include_bytes!("../../../trainer/recipes/neural-n8.recipe"),
    include_bytes!("../../../trainer/recipes/linear-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/phong-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/cook-torrance-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/neural-n8.recipe"),
    include_bytes!("../../../trainer/recipes/completed/linear-n8.recipe"),
];
pub(crate) const NEURAL: &[u8] = RECIPES[2];
/// A recipe of 16 samples that tolerates missing readings.
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
        let words = vec![0xA5A5_5A5A_C3C3_3C3C; bytes.div_ceil(8)];
        let words = words.into_boxed_slice();
        Self { words, bytes }
    }

    pub(crate) fn for_scan() -> Self {
        Self::new(scan_bytes(WORDS).unwrap())
    }

    pub(crate) fn for_driver() -> Self {
        Self::new(driver_bytes(WORDS).unwrap())
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
    let bytes = memory.bytes;
    let status = unsafe {
        glimpse_scan_begin(
            memory.pointer(),
            bytes,
            recipe.as_ptr(),
            recipe.len(),
            &raw mut scan,
        )
    };
    assert_eq!(status == glimpse_status::Ok, !scan.is_null());
    (status, scan)
}

/// Returns a reading that differs between samples.
pub(crate) fn reading(index: u16) -> glimpse_reading {
    let value = 0.05 + 0.02 * f32::from(index % 7);
    glimpse_reading {
        brdf: [value, 0.8 * value, 0.5 * value],
        saturated: 0,
    }
}

/// Records readings of all pending samples and returns their number.
pub(crate) fn record_all(scan: *mut glimpse_scan) -> usize {
    let mut sample = glimpse_sample::default();
    let mut count = 0;
    while unsafe { glimpse_scan_next(scan, 0, &raw mut sample) } == glimpse_status::Ok {
        let reading = reading(sample.index);
        let status =
            unsafe { glimpse_scan_record(scan, sample.index, &raw const reading, null_mut()) };
        assert_eq!(status, glimpse_status::Ok);
        count += 1;
    }
    count
}

/// A fit with core.
pub(crate) struct CoreFit {
    /// The bits of the values.
    pub(crate) values: Vec<u32>,
    pub(crate) predicted_loss: Option<f32>,
    pub(crate) loss_bound: Option<f32>,
    pub(crate) is_unlike_training: Option<bool>,
}

/// Fits the same readings with core.
pub(crate) fn fit_with_core(recipe: &[u8]) -> CoreFit {
    use glimpse_core::recipe::Recipe;
    use glimpse_core::scan::Scan;

    let mut memory = vec![0.0; WORDS];
    let recipe = Recipe::parse(recipe).unwrap();
    let mut scan = Scan::<Fitter>::new(recipe, &mut memory).unwrap();
    while let Some((index, _)) = scan.next_pending() {
        scan.record(index, reading(index).into()).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish().unwrap();
    CoreFit {
        values: fitted.values().map(f32::to_bits).collect(),
        predicted_loss: fitted.predicted_loss(),
        loss_bound: fitted.loss_bound(),
        is_unlike_training: fitted.is_unlike_training(),
    }
}

/// Fits the same readings with core. Returns the bits of the values.
pub(crate) fn values_with_core(recipe: &[u8]) -> Vec<u32> {
    fit_with_core(recipe).values
}

pub(crate) static MIRROR: glimpse_directions = glimpse_directions {
    incoming: [0.6, 0.0, 0.8],
    outgoing: [-0.6, 0.0, 0.8],
};
