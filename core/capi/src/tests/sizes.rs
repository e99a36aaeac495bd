//! Tests of memory sizes: large enough, and not much larger.

use core::ptr::null;

use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::memory_words;

use super::{MASKED, NEURAL, RECIPES};
use crate::configuration::{ALIGNMENT, driver_bytes, scan_bytes};
use crate::driver::glimpse_driver_bytes;
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
        let words = memory_words(&[recipe]);
        let [scan, driver] = bytes(recipe);
        assert!((scan..scan + 256).contains(&scan_bytes(words).unwrap()));
        assert!((driver..driver + 256).contains(&driver_bytes(words).unwrap()));
    }
    assert_eq!(ALIGNMENT, 8);
}

#[test]
fn unusable_recipe_has_size_0() {
    let cut = NEURAL.get(1..).unwrap();
    for recipe in [b"".as_slice(), b"no recipe", cut] {
        assert_eq!(bytes(recipe), [0, 0]);
    }
    unsafe {
        assert_eq!(glimpse_scan_bytes(null(), 9), 0);
        assert_eq!(glimpse_driver_bytes(null(), 9), 0);
        assert_eq!(glimpse_scan_bytes(NEURAL.as_ptr(), usize::MAX), 0);
    }
}

/// The constants of `GLIMPSE_PHONG_WORDS` and the other macros are the sum of: the parameters, the larger of gradient
/// and completion, and the predicted loss.
#[test]
fn words_macros_match_core_bounds() {
    let header = include_str!("../../include/glimpse.h");
    for (model, name) in [
        (ModelKind::Phong, "PHONG"),
        (ModelKind::CookTorrance, "COOK_TORRANCE"),
        (ModelKind::Neural, "NEURAL"),
    ] {
        let parameters = model.parameters().unwrap();
        let words = parameters + parameters.max(4 * MAX_ROWS + MAX_UNITS) + 1;
        let line =
            std::format!("#define GLIMPSE_{name}_WORDS(samples) (9 * (samples) + {words})\n");
        assert!(header.contains(&line), "{line}");
    }
}
