//! Tests of memory sizes: large enough, and not much larger.

use std::vec;
use std::vec::Vec;

use glimpse_core::fit::ridge::packed_length;
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    PackedCoefficientNet, PackedCorrection, PackedDescent, PackedGaussNewton, PackedInitNet,
    PackedMethod, PackedTarget, Recipe, RecipeParts, memory_words,
};

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

/// Counts of a recipe with a correction.
#[derive(Clone, Copy)]
struct Shape {
    /// n.
    samples: usize,
    /// m + h, the rows of the net for m coefficients with h hidden units.
    rows: usize,
    /// g, the units of the init net.
    units: usize,
}

/// m and K, the numbers of coefficients before and after the correction. The trainer makes no larger correction for
/// models that the macros are for.
const COMPONENTS: usize = 24;
/// The largest shape of a recipe that the trainer makes for a device.
const TRAINED: Shape = Shape {
    samples: 64,
    rows: COMPONENTS + 64,
    units: 32,
};

/// A list of ones, packed.
fn ones(count: usize) -> Vec<u8> {
    1.0_f32.to_le_bytes().repeat(count)
}

/// The active parameters of a step, in each of its systems.
fn active(model: ModelKind) -> usize {
    match model {
        ModelKind::Neural => 22,
        model => model.parameters().unwrap(),
    }
}

/// A recipe with a correction, and then Gauss-Newton steps or a descent.
fn corrected_recipe(model: ModelKind, has_steps: bool, shape: Shape) -> Vec<u8> {
    const VIRTUAL_READINGS: usize = 3;
    let Shape {
        samples,
        rows,
        units,
    } = shape;
    let parameters = model.parameters().unwrap();
    let directions = |count: usize| 0.3_f32.to_le_bytes().repeat(3 * count);
    let (pattern, virtual_directions) = (directions(samples), directions(VIRTUAL_READINGS));
    // Long enough for each list.
    let (numbers, weights) = (ones(4096), vec![1; 1 << 16]);
    let list = |count: usize| &numbers[..4 * count];
    let weights = |count: usize| &weights[..count];
    let completion = PackedCoefficientNet {
        components: COMPONENTS as u16,
        missing: 2,
        center: list(samples),
        scale: 1.0,
        readings: weights(samples * 3 * rows),
        reading_scales: list(rows),
        bias: list(rows),
        output: weights(COMPONENTS * (rows - COMPONENTS)),
        output_scales: list(COMPONENTS),
        rows: &[],
        row_scales: &[],
        basis_checksum: 0,
    };
    let correction = PackedCorrection {
        rows: weights(samples * COMPONENTS),
        row_scales: list(COMPONENTS),
        precision: list(COMPONENTS),
    };
    let init_net = PackedInitNet {
        hidden: weights(units * 3 * COMPONENTS),
        hidden_scales: list(units),
        bias: list(units),
        output: weights(parameters * units),
        output_scales: list(parameters),
    };
    let target = if has_steps {
        let steps = PackedGaussNewton {
            model,
            steps: 2,
            initial: list(parameters),
            precision: list(active(model)),
            reading_weight: 1.0,
            error_scale: 1.0,
            directions: &virtual_directions,
            center: list(VIRTUAL_READINGS),
            rows: weights(VIRTUAL_READINGS * COMPONENTS),
            row_scales: list(COMPONENTS),
        };
        PackedTarget::GaussNewton(steps, init_net)
    } else {
        let descent = PackedDescent {
            model,
            inner_steps: 1,
            initial: list(parameters),
            step_sizes: list(parameters),
        };
        PackedTarget::Descent(descent, init_net)
    };
    let method = PackedMethod::Completed(completion, Some(correction), target);
    let mut buffer = vec![0; 1 << 18];
    let recipe = Recipe::write(&RecipeParts::new(&pattern, method), &mut buffer);
    recipe.unwrap().to_vec()
}

/// The words of a recipe. Checks that all functions return the same number.
fn words_of(recipe: &[u8]) -> usize {
    let words = Recipe::parse(recipe).unwrap().memory_words();
    assert_eq!(memory_words(&[recipe]), words);
    words
}

/// The constant of a macro like `GLIMPSE_PHONG_WORDS`.
fn constant(name: &str) -> usize {
    let header = include_str!("../../include/glimpse.h");
    let start = std::format!("#define GLIMPSE_{name}_WORDS(samples) (10 * (samples) + ");
    let (_, rest) = header.split_once(&start).unwrap();
    let (number, _) = rest.split_once(")\n").unwrap();
    number.parse().unwrap()
}

/// The macros are the memory of the largest recipes that core accepts, with corrections of [`COMPONENTS`]: parameters,
/// Gauss-Newton systems with their initial parameters, net, correction, init net, and the predicted loss.
#[test]
fn words_macros_match_core_bounds() {
    for (model, name, systems) in [
        (ModelKind::Phong, "PHONG", 1),
        (ModelKind::CookTorrance, "COOK_TORRANCE", 1),
        (ModelKind::Neural, "NEURAL", 3),
    ] {
        let active = active(model);
        let steps = systems * (active + packed_length(active) + active);
        let correction = packed_length(COMPONENTS) + 3 * COMPONENTS + 1;
        let completion = 4 * MAX_ROWS + correction + MAX_UNITS;
        let words = model.parameters().unwrap() + steps + completion + 1;
        assert_eq!(constant(name), words, "{name}");
        for samples in [8, TRAINED.samples] {
            let largest = Shape {
                samples,
                rows: MAX_ROWS,
                units: MAX_UNITS,
            };
            let recipe = corrected_recipe(model, true, largest);
            assert_eq!(words_of(&recipe), 10 * samples + words, "{name}");
            let trained = Shape { samples, ..TRAINED };
            for (shape, has_steps) in [(largest, false), (trained, true), (trained, false)] {
                let recipe = corrected_recipe(model, has_steps, shape);
                assert!(words_of(&recipe) < 10 * samples + words, "{name}");
            }
        }
    }
}
