//! Tests of memory sizes: large enough, and not much larger.

use glimpse_core::recipe::memory_words;

use super::{MASKED, RECIPES};
use crate::driver::glimpse_driver_bytes;
use crate::handle::{ALIGNMENT, DRIVER_BYTES, SCAN_BYTES};
use crate::scan::glimpse_scan_bytes;

fn bytes(recipe: &[u8]) -> [usize; 2] {
    let (pointer, count) = (recipe.as_ptr(), recipe.len());
    unsafe {
        [
            glimpse_scan_bytes(pointer, count),
            glimpse_driver_bytes(pointer, count),
        ]
    }
}

/// The compiler checks that the macros are large enough. This test checks that they are not much larger.
#[test]
fn header_macros_are_tight() {
    for recipe in RECIPES.into_iter().chain([MASKED]) {
        let memory = 4 * memory_words(&[recipe]);
        let [scan, driver] = bytes(recipe);
        assert!((scan..scan + 64).contains(&(SCAN_BYTES + memory)));
        assert!((driver..driver + 64).contains(&(DRIVER_BYTES + memory)));
    }
    assert_eq!(ALIGNMENT, 8);
}
