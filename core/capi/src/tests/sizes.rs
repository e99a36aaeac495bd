//! Tests of memory sizes: large enough, and not much larger.

use glimpse_core::recipe::memory_words;

use super::{MASKED, RECIPES};
use crate::driver::glimpse_driver_bytes;
use crate::handle::{ALIGNMENT, DRIVER_BYTES, SCAN_BYTES};
use crate::scan::glimpse_scan_bytes;

macro_rules! recipe {
    ($name:literal) => {
        include_bytes!(concat!(
            "../../../../trainer/recipes/completed/",
            $name,
            ".recipe"
        ))
    };
}

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

/// The largest bundled recipes, of 32 samples: 24 components, and a net with 88 of the 96 rows that core accepts.
const LARGEST: [(&[u8], &str); 3] = [
    (recipe!("phong-n32"), "PHONG"),
    (recipe!("cook-torrance-n32"), "COOK_TORRANCE"),
    (recipe!("neural-n32"), "NEURAL"),
];

/// The constant of a macro like `GLIMPSE_PHONG_WORDS`.
fn constant(name: &str) -> usize {
    let header = include_str!("../../include/glimpse.h");
    let start = std::format!("#define GLIMPSE_{name}_WORDS(samples) (14 * (samples) + ");
    let (_, rest) = header.split_once(&start).unwrap();
    let (number, _) = rest.split_once(")\n").unwrap();
    number.parse().unwrap()
}

/// The macros are the memory of recipes with 24 components and a net of 96 rows, each of which takes four words.
#[test]
fn words_macros_are_tight() {
    for (recipe, name) in LARGEST {
        let words = 14 * 32 + constant(name);
        assert_eq!(memory_words(&[recipe]) + 4 * (96 - 88), words, "{name}");
    }
}
