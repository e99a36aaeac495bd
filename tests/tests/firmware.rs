//! The firmware in QEMU, in front of a good scanner. What happens on bad days is in `faults`.

use glimpse_bench::recipes;
use glimpse_core::recipe::Recipe;
use glimpse_materials::Material;
use glimpse_tests::RECIPE;
use glimpse_tests::device::{assert_agrees, fit};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{scanner, unseen};
use glimpse_trainer::bundled;
use glimpse_trainer::evaluation::{Evaluator, Method};
use glimpse_trainer::scanner::{ScannerNoise, VirtualScanner};

#[test]
fn a_scan_loses_what_evaluate_says() {
    let mut emulator = Emulator::boot_as_built();
    let recipe = Recipe::parse(RECIPE).unwrap();
    for index in 0..3 {
        let material = unseen(index);
        let report = scanner(&material).serve(&mut emulator.serial).unwrap();
        let materials: [Box<dyn Material>; 1] = [Box::new(material.clone())];
        let report = Evaluator::new(&materials)
            .judge(&Method::ours(&recipe, None).unwrap(), 0, 1)
            .unwrap();
        let (scan, evaluate) = (report.loss(None, &material).unwrap(), report.scores.loss);
        // A sample of this recipe is at the pole, where phi_d is lost on the way through directions:
        // what the scanner reads there differs a little from what `evaluate` reads.
        assert!(
            (scan / evaluate - 1.0).abs() < 1e-2,
            "{scan}, evaluate says {evaluate}"
        );
    }
}

#[test]
fn scans_of_unseen_materials_agree_with_the_host_one_after_the_other() {
    let mut emulator = Emulator::boot_as_built();
    for index in 0..3 {
        let material = unseen(index);
        let noise = ScannerNoise {
            deviation: 0.02 * index as f32,
            seed: 1,
        };
        let report = VirtualScanner::new(&material, noise)
            .serve(&mut emulator.serial)
            .unwrap();
        assert_agrees(&report, RECIPE);
    }
    let instructions: u64 = emulator.wait_for("fit_instructions=").parse().unwrap();
    let stack: u64 = emulator.wait_for("stack_bytes=").parse().unwrap();
    // Broken meters would show zero, or an instruction for each multiplication and fewer.
    assert!(instructions > 282_000, "{instructions}");
    assert!((500..8192).contains(&stack), "{stack}");
}

/// Bounds checks, `unwrap`, slicing and their like all call functions of `core::panicking`.
#[test]
fn nothing_in_the_firmware_can_panic() {
    let mut symbols = Firmware::load().symbols();
    assert!(
        symbols.iter().any(|name| name == "main"),
        "the symbols are stripped"
    );
    // defmt brings a way to panic of its own. Some linkers keep it, though nothing calls it.
    let defmt = symbols.iter().any(|name| name == "__defmt_default_panic");
    symbols.retain(|name| name.contains("panicking") || name.contains("_failed"));
    if defmt {
        symbols.retain(|name| !name.contains("9panic_fmt") && !name.contains("panicking5panic"));
    }
    assert!(symbols.is_empty(), "{symbols:#?}");
}

/// What a first bring-up looks for in the log. QEMU records no cause, and has no clocks.
#[test]
fn a_boot_says_why_and_at_which_clock() {
    let emulator = Emulator::boot_as_built();
    assert_eq!(emulator.wait_for("reset: "), "Unknown");
    assert_ne!(emulator.wait_for("clock: "), "");
}

/// Scans some materials with a recipe in a model's image; the results have the bits of the host's fits.
fn assert_scans_like_the_host(name: &str, recipe: &[u8], materials: usize) {
    let model = Recipe::parse(recipe).unwrap().model();
    let firmware = Firmware::of_model(model);
    let image = firmware.with_recipe(recipe);
    let mut emulator = Emulator::boot(&firmware, image.path());
    for index in 0..materials {
        let report = scanner(&unseen(index)).serve(&mut emulator.serial).unwrap();
        assert_eq!(report.model, model);
        let (values, residual) = fit(recipe, &report.readings);
        let bits = |values: &[f32]| -> Vec<u32> { values.iter().map(|x| x.to_bits()).collect() };
        assert_eq!(bits(&report.values), bits(&values), "{name}");
        assert_eq!(report.residual, residual, "{name}");
    }
}

/// The same source and driver for every model; only the recipe is another one.
#[test]
fn every_model_is_scanned_to_the_bits_of_the_hosts_fit() {
    for (name, recipe) in [
        ("phong", recipes::PHONG),
        ("cook-torrance", recipes::COOK_TORRANCE),
        ("neural", recipes::NEURAL),
        ("linear", recipes::LINEAR),
    ] {
        assert_scans_like_the_host(name, recipe, 2);
    }
}

/// Every bundled recipe is tried as users flash it.
#[test]
fn every_bundled_recipe_is_scanned_to_the_bits_of_the_hosts_fit() {
    for bundled in bundled::ALL {
        assert_scans_like_the_host(bundled.name, bundled.bytes, 1);
    }
}
