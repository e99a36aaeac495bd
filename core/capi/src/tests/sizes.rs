//! Sizes of memory: enough, and little more.

use core::ptr::null;

use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::memory_words;

use super::{MASKED, NEURAL, RECIPES};
use crate::configuration::{ALIGNMENT, driver_bytes, scan_bytes};
use crate::driver::glimpse_driver_bytes;
use crate::scan::glimpse_scan_bytes;

fn least(recipe: &[u8]) -> [usize; 2] {
    let (pointer, count) = (recipe.as_ptr(), recipe.len());
    unsafe {
        [
            glimpse_scan_bytes(pointer, count),
            glimpse_driver_bytes(pointer, count),
        ]
    }
}

/// The compiler checks that the macros are large enough; this test, that they waste little.
#[test]
fn the_macros_of_the_header_waste_little() {
    for recipe in RECIPES.into_iter().chain([MASKED]) {
        let words = memory_words(&[recipe]);
        let [scan, driver] = least(recipe);
        assert!((scan..scan + 256).contains(&scan_bytes(words).unwrap()));
        assert!((driver..driver + 256).contains(&driver_bytes(words).unwrap()));
    }
    assert_eq!(ALIGNMENT, 8);
}

#[test]
fn an_unusable_recipe_has_no_size() {
    let cut = NEURAL.get(1..).unwrap();
    for recipe in [b"".as_slice(), b"no recipe", cut] {
        assert_eq!(least(recipe), [0, 0]);
    }
    unsafe {
        assert_eq!(glimpse_scan_bytes(null(), 9), 0);
        assert_eq!(glimpse_driver_bytes(null(), 9), 0);
        assert_eq!(glimpse_scan_bytes(NEURAL.as_ptr(), usize::MAX), 0);
    }
}

/// The numbers of `GLIMPSE_PHONG_WORDS` and its siblings: parameters, the larger of gradient and completion, and the
/// predicted loss.
#[test]
fn the_words_of_each_model_are_the_bounds_of_core() {
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
