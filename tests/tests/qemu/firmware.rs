//! The firmware with a scanner without faults. `faults` tests the faults.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Evaluator, Method};
use glimpse_fitting::recipe::ReadingNoise;
use glimpse_fitting::scanner::VirtualScanner;
use glimpse_materials::Material;
use glimpse_tests::device::assert_matches_host;
use glimpse_tests::emulator::Emulator;
use glimpse_tests::host::{noiseless_scanner, unseen_material};
use glimpse_tests::{RECIPE, recipes};

#[test]
fn consecutive_scans_agree_with_host_and_evaluate() {
    let mut emulator = Emulator::boot();
    let recipe = Recipe::parse(RECIPE).unwrap();
    for (index, deviation) in [(0, 0.0), (1, 0.0), (2, 0.04)] {
        let material = unseen_material(index);
        let noise = ReadingNoise {
            multiplicative: deviation,
            ..ReadingNoise::default()
        };
        let report = VirtualScanner::new(Some(&material), noise, 1)
            .serve(&mut emulator.serial)
            .unwrap();
        assert_matches_host(&report, RECIPE);
        if deviation > 0.0 {
            continue;
        }
        let scan_loss = report.loss(None, &material).unwrap();
        let materials: [Box<dyn Material>; 1] = [Box::new(material)];
        let evaluated_loss = Evaluator::new(&materials)
            .evaluate(&Method::with_recipe(&recipe, None).unwrap(), 0, 1)
            .unwrap()
            .metrics
            .loss;
        // One sample of this recipe is at the pole, where the conversion to directions loses phi_d. The readings of the
        // scanner and of `evaluate` differ slightly there.
        assert!(
            (scan_loss / evaluated_loss - 1.0).abs() < 1e-2,
            "loss {scan_loss} of the scan, {evaluated_loss} of evaluate"
        );
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
