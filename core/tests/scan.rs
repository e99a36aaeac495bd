//! A scan refuses what cannot be measured, and its result does not depend on how it is sliced.

mod common;

use common::{neural, write};
use glimpse_core::fit::Workspace;
use glimpse_core::model::{ModelKind, Neural, ParameterSet, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Measurement, MeasurementError, Residual, Scan, ScanError};
use proptest::prelude::*;

/// A measurement that is not saturated.
fn measured(brdf: [f32; 3]) -> Measurement {
    Measurement {
        brdf,
        saturated: false,
    }
}

/// Bits of all parameters, and the residual, after a fit in slices of the given budgets.
fn fit(measurements: &[[f32; 3]], budgets: &[usize]) -> (Vec<u32>, Residual) {
    let bytes = write(&neural()).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut scan = Scan::<Neural, 8>::new(recipe, &mut workspace).unwrap();
    for brdf in measurements {
        scan.record(measured(*brdf)).unwrap();
    }
    let mut budgets = budgets.iter().cycle();
    let mut done = 0;
    loop {
        let budget = *budgets.next().unwrap();
        let progress = scan.advance_fit(budget);
        assert!(
            progress.done - done <= budget as u32,
            "the slice was too long"
        );
        done = progress.done;
        assert_eq!(progress.total, 8 * 20);
        if progress.is_complete() {
            break;
        }
    }
    let bits = scan.parameters().iter().map(|p| p.to_bits()).collect();
    (bits, scan.residual())
}

#[test]
fn impossible_measurements_are_refused_and_asked_for_again() {
    let bytes = write(&neural()).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 8>::new(Recipe::parse(&bytes).unwrap(), &mut workspace).unwrap();
    let (index, directions) = scan.next_directions().unwrap();
    for (brdf, error) in [
        ([f32::NAN, 0.1, 0.1], MeasurementError::NonFinite(0)),
        ([0.1, f32::INFINITY, 0.1], MeasurementError::NonFinite(1)),
        ([0.1, 0.1, -0.1], MeasurementError::Negative(2)),
        (
            [0.1, 0.1, f32::NEG_INFINITY],
            MeasurementError::NonFinite(2),
        ),
    ] {
        assert_eq!(scan.record(measured(brdf)), Err(error));
        assert_eq!(scan.next_directions(), Some((index, directions)));
    }
    // Dark is possible.
    assert_eq!(scan.record(measured([0.0; 3])), Ok(()));
    assert_eq!(scan.next_directions().unwrap().0, 1);
}

#[test]
fn nothing_is_fitted_before_all_is_measured() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 8>::new(recipe, &mut workspace).unwrap();
    for _ in 0..7 {
        scan.record(measured([0.2; 3])).unwrap();
    }
    assert_eq!(scan.advance_fit(1_000).done, 0);
    assert!(
        scan.parameters()
            .iter()
            .copied()
            .eq(recipe.initial().iter())
    );
}

#[test]
fn no_more_is_taken_than_was_asked_for() {
    let bytes = write(&neural()).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    // Room for more than the recipe asks.
    let mut scan = Scan::<Neural, 9>::new(Recipe::parse(&bytes).unwrap(), &mut workspace).unwrap();
    while scan.next_directions().is_some() {
        scan.record(measured([0.2; 3])).unwrap();
    }
    assert_eq!(
        scan.record(measured([0.2; 3])),
        Err(MeasurementError::Complete)
    );
}

#[test]
fn saturated_measurements_are_counted_until_the_scan_begins_anew() {
    let bytes = write(&neural()).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 8>::new(Recipe::parse(&bytes).unwrap(), &mut workspace).unwrap();
    for index in 0..8 {
        let measurement = Measurement {
            brdf: [0.3; 3],
            saturated: index < 3,
        };
        scan.record(measurement).unwrap();
    }
    assert_eq!(scan.residual().saturated, 3);
    scan.restart();
    assert_eq!(scan.residual().saturated, 0);
    assert_eq!(scan.next_directions().unwrap().0, 0);
}

#[test]
fn a_recipe_for_another_firmware_is_refused() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut phong = Workspace::<Phong>::new();
    assert_eq!(
        Scan::<Phong, 8>::new(recipe, &mut phong).err(),
        Some(ScanError::Model {
            firmware: ModelKind::Phong,
            recipe: ModelKind::Neural
        })
    );
    let mut workspace = Workspace::<Neural>::new();
    assert_eq!(
        Scan::<Neural, 7>::new(recipe, &mut workspace).err(),
        Some(ScanError::Capacity {
            capacity: 7,
            samples: 8
        })
    );
}

#[test]
fn a_second_scan_in_the_same_workspace_is_like_the_first() {
    let bytes = write(&neural()).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 8>::new(Recipe::parse(&bytes).unwrap(), &mut workspace).unwrap();
    let mut results = Vec::new();
    for _ in 0..2 {
        while scan.next_directions().is_some() {
            scan.record(measured([0.4, 0.2, 0.1])).unwrap();
        }
        while !scan.advance_fit(5).is_complete() {}
        results.push(*scan.parameters());
        scan.restart();
    }
    assert_eq!(results[0], results[1]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn slices_do_not_change_the_result(
        measurements in prop::collection::vec(prop::array::uniform3(0.0..5.0f32), 8),
        budgets in prop::collection::vec(1..40usize, 1..6),
    ) {
        let (at_once, residual) = fit(&measurements, &[8 * 20]);
        let (sliced, residual_sliced) = fit(&measurements, &budgets);
        prop_assert_eq!(at_once, sliced);
        prop_assert_eq!(residual, residual_sliced);
    }
}
