//! A scan refuses what cannot be measured, and its result does not depend on how it is sliced.

mod common;

use common::{linear, neural, write, write_linear};
use glimpse_core::fit::ridge::RidgeError;
use glimpse_core::fit::{Progress, Workspace};
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::model::{ModelKind, Neural, ParameterSet, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LinearScan, Measurement, MeasurementError, Residual, Scan, ScanError};
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
            .eq(recipe.descent().unwrap().initial().iter())
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
fn a_stuck_sensor_is_told_from_one_that_works() {
    let repeated = |measurements: &[[f32; 3]; 8]| fit(measurements, &[160]).1.repeated;
    assert_eq!(repeated(&[[0.3, 0.2, 0.1]; 8]), 7);
    let mut measurements = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| [0.3 + 0.01 * k as f32; 3]);
    assert_eq!(repeated(&measurements), 0);
    measurements[4] = measurements[3];
    assert_eq!(repeated(&measurements), 1);
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

/// Memory for n = 8 and m = 5.
const MEMORY: usize = LinearScan::<8>::memory_length(8, 5);

/// What is measured at a sample in tests of [`LinearScan`].
fn colour(index: u16) -> [f32; 3] {
    [0.2 + 0.1 * f32::from(index), 0.3, 0.05 * f32::from(index)]
}

#[test]
fn a_linear_scan_ends_in_coefficients() {
    let numbers = linear();
    let bytes = write_linear(&numbers).unwrap();
    let mut memory = [f32::NAN; MEMORY];
    let mut scan = LinearScan::<8>::new(Recipe::parse(&bytes).unwrap(), &mut memory).unwrap();
    let mut results = Vec::new();
    for _ in 0..2 {
        assert_eq!(scan.coefficients(), [0.0; 15]);
        while let Some((index, _)) = scan.next_directions() {
            assert_eq!(scan.advance_fit(3), Progress { done: 0, total: 3 });
            let measurement = Measurement {
                brdf: colour(index),
                saturated: index < 2,
            };
            scan.record(measurement).unwrap();
        }
        assert_eq!(
            scan.record(measured([0.1; 3])),
            Err(MeasurementError::Complete)
        );
        assert_eq!(scan.advance_fit(0).done, 0);
        assert_eq!(scan.advance_fit(1).done, 1);
        assert_eq!(scan.coefficients()[5..], [0.0; 10]);
        let progress = scan.advance_fit(7);
        assert!(progress.is_complete() && progress.done == 3);
        assert!(scan.advance_fit(7).is_complete());
        results.push((scan.coefficients().to_vec(), scan.residual()));
        assert_eq!(scan.residual().saturated, 2);
        scan.restart();
        assert_eq!(scan.residual().saturated, 0);
    }
    assert_eq!(results[0], results[1]);

    // The normal equations hold: A'(t - A c) = P c. And the residual is that of the definition.
    let (coefficients, residual) = &results[0];
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut errors = [0.0_f32; 8];
    for (channel, c) in coefficients.chunks(5).enumerate() {
        let mut left: Vec<f64> = c.iter().map(|c| -40.0 * f64::from(*c)).collect();
        let mut scale = 0.0_f64;
        for (sample, row) in numbers.basis.chunks(5).enumerate() {
            let (mean, median) = (numbers.mean[sample], numbers.median[sample]);
            let weight = numbers.weight[sample];
            let y = colour(sample as u16)[channel];
            let explained: f32 = row.iter().zip(c).map(|(a, c)| a * c).sum();
            let rest = f64::from(map(y, median, weight) - mean - explained);
            for (left, a) in left.iter_mut().zip(row) {
                *left += f64::from(*a) * rest;
                scale = scale.max((f64::from(*a) * rest).abs());
            }
            let f = unmap(explained + mean, median, weight);
            let at = recipe.pattern().nth(sample).unwrap();
            let at = glimpse_core::geometry::HalfDifference::from_angles(at);
            let cosine = at.cos_theta_i();
            errors[sample] += ((1.0 + f * cosine) / (1.0 + y * cosine)).ln().abs() / 3.0;
        }
        for left in left {
            assert!(left.abs() < 1e-5 * scale, "{left} of {scale}");
        }
    }
    let mean: f32 = errors.iter().sum::<f32>() / 8.0;
    let worst = errors.iter().copied().fold(0.0, f32::max);
    let tolerance = if cfg!(feature = "micromath") {
        1e-3
    } else {
        1e-5
    };
    assert!(
        (residual.mean - mean).abs() < tolerance,
        "{residual:?}, {mean}"
    );
    assert!((residual.worst - worst).abs() < tolerance);
    assert!((errors[usize::from(residual.worst_index)] - worst).abs() < tolerance);
}

#[test]
fn a_linear_scan_refuses_impossible_measurements() {
    let bytes = write_linear(&linear()).unwrap();
    let mut memory = [0.0; MEMORY];
    let mut scan = LinearScan::<8>::new(Recipe::parse(&bytes).unwrap(), &mut memory).unwrap();
    let first = scan.next_directions();
    let refused = scan.record(measured([0.1, f32::NAN, 0.1]));
    assert_eq!(refused, Err(MeasurementError::NonFinite(1)));
    let refused = scan.record(measured([0.1, 0.1, -0.1]));
    assert_eq!(refused, Err(MeasurementError::Negative(2)));
    assert_eq!(scan.next_directions(), first);
}

#[test]
fn a_linear_recipe_is_for_linear_scans_only() {
    let bytes = write_linear(&linear()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut workspace = Workspace::<Neural>::new();
    assert_eq!(
        Scan::<Neural, 8>::new(recipe, &mut workspace).err(),
        Some(ScanError::Model {
            firmware: ModelKind::Neural,
            recipe: ModelKind::Linear
        })
    );
    let neural = write(&neural()).unwrap();
    let mut memory = [0.0; MEMORY];
    assert_eq!(
        LinearScan::<8>::new(Recipe::parse(&neural).unwrap(), &mut memory).err(),
        Some(ScanError::Model {
            firmware: ModelKind::Linear,
            recipe: ModelKind::Neural
        })
    );
    assert_eq!(
        LinearScan::<7>::new(recipe, &mut memory).err(),
        Some(ScanError::Capacity {
            capacity: 7,
            samples: 8
        })
    );
    for found in 0..MEMORY {
        assert_eq!(
            LinearScan::<8>::new(recipe, &mut memory[..found]).err(),
            Some(ScanError::Memory {
                needed: MEMORY,
                found
            })
        );
    }
    assert!(LinearScan::<8>::new(recipe, &mut memory).is_ok());
    let mut numbers = linear();
    numbers.basis.fill(1e4);
    numbers.precision.fill(1e-3);
    let bytes = write_linear(&numbers).unwrap();
    let refused = LinearScan::<8>::new(Recipe::parse(&bytes).unwrap(), &mut memory).err();
    assert_eq!(refused, Some(ScanError::Ridge(RidgeError::Pivot(1))));
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
