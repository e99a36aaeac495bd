//! The firmware with a scanner without faults. `faults` tests the faults.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Evaluator, Method};
use glimpse_fitting::scanner::{ScannerNoise, VirtualScanner};
use glimpse_materials::Material;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_tests::{RECIPE, recipes};

#[test]
fn scan_loss_matches_evaluate() {
    let mut emulator = Emulator::boot();
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
    let mut emulator = Emulator::boot();
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

/// One image scans with recipes of all models and kinds.
#[test]
fn every_recipe_matches_host_fit_bit_for_bit() {
    for (_, bytes) in recipes() {
        let mut emulator = Emulator::boot_recipe(bytes);
        let report = noiseless_scanner(&unseen_material(0))
            .serve(&mut emulator.serial)
            .unwrap();
        assert_matches_host(&report, bytes);
    }
}
