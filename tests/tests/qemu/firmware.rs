//! The firmware with a scanner without faults. `faults` tests the faults.

use glimpse_core::recipe::Recipe;
use glimpse_materials::Material;
use glimpse_tests::RECIPE;
use glimpse_tests::device::{assert_matches_host, fit};
use glimpse_tests::elf::Firmware;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_trainer::bundled;
use glimpse_trainer::evaluation::{Evaluator, Method};
use glimpse_trainer::scanner::{ScannerNoise, VirtualScanner};

#[test]
fn scan_loss_matches_evaluate() {
    let mut emulator = Emulator::boot_default();
    let recipe = Recipe::parse(RECIPE).unwrap();
    for index in 0..3 {
        let material = unseen_material(index);
        let scan_report = noiseless_scanner(&material)
            .serve(&mut emulator.serial)
            .unwrap();
        let materials: [Box<dyn Material>; 1] = [Box::new(material.clone())];
        let report = Evaluator::new(&materials)
            .evaluate(&Method::with_recipe(&recipe, None).unwrap(), 0, 1)
            .unwrap();
        let scan_loss = scan_report.loss(None, &material).unwrap();
        let evaluated_loss = report.metrics.loss;
        // One sample of this recipe is at the pole, where the conversion to directions loses phi_d. The readings of the
        // scanner and of `evaluate` differ slightly there.
        assert!(
            (scan_loss / evaluated_loss - 1.0).abs() < 1e-2,
            "loss {scan_loss} of the scan, {evaluated_loss} of evaluate"
        );
    }
}

#[test]
fn consecutive_scans_agree_with_host() {
    let mut emulator = Emulator::boot_default();
    for index in 0..3 {
        let material = unseen_material(index);
        let noise = ScannerNoise {
            deviation: 0.02 * index as f32,
            seed: 1,
        };
        let report = VirtualScanner::new(&material, noise)
            .serve(&mut emulator.serial)
            .unwrap();
        assert_matches_host(&report, RECIPE);
    }
    let instructions: u64 = emulator.wait_for("fit_instructions=").parse().unwrap();
    let stack: u64 = emulator.wait_for("stack_bytes=").parse().unwrap();
    // A broken counter would show 0, or fewer instructions than the fit has multiplications.
    assert!(instructions > 282_000, "{instructions}");
    assert!((500..8192).contains(&stack), "{stack}");
}

/// Bounds checks, `unwrap`, slicing and similar operations call functions of `core::panicking`.
#[test]
fn firmware_cannot_panic() {
    let mut symbols = Firmware::load().symbols();
    assert!(
        symbols.iter().any(|name| name == "main"),
        "the symbols are stripped"
    );
    // defmt has its own panic function. Some linkers keep it although it is never called.
    let has_defmt_panic = symbols.iter().any(|name| name == "__defmt_default_panic");
    symbols.retain(|name| name.contains("panicking") || name.contains("_failed"));
    if has_defmt_panic {
        symbols.retain(|name| !name.contains("9panic_fmt") && !name.contains("panicking5panic"));
    }
    assert!(symbols.is_empty(), "{symbols:#?}");
}

/// Scans with every bundled recipe that has a pattern, as users flash it. Source and driver are the same for every model;
/// only the recipe differs.
#[test]
fn every_bundled_recipe_matches_host_fit_bit_for_bit() {
    for bundled in bundled::ALL {
        let recipe = Recipe::parse(bundled.bytes).unwrap();
        let model = recipe.model();
        if recipe.samples() == 0 {
            continue;
        }
        let firmware = Firmware::for_model(model);
        let image = firmware.with_recipe(bundled.bytes);
        let mut emulator = Emulator::boot(&firmware, image.path());
        let report = noiseless_scanner(&unseen_material(0))
            .serve(&mut emulator.serial)
            .unwrap();
        assert_eq!(report.model, model);
        let (values, residual) = fit(bundled.bytes, &report.readings);
        let bits = |values: &[f32]| -> Vec<u32> { values.iter().map(|x| x.to_bits()).collect() };
        assert_eq!(bits(&report.values), bits(&values), "{}", bundled.name);
        assert_eq!(report.residual, residual, "{}", bundled.name);
    }
}
