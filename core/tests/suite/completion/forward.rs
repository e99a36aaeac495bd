//! The device's forward pass matches the formulas, number by number.

use glimpse_core::fit::coefficient_net::{Input, MissingPolicy, standardized};
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS, Target};
use glimpse_core::model::ModelKind;

use super::contents::{CompletedContents, SMALL, Shape};
use super::reference::{
    Readings, TOLERANCE, all_readings, assert_close, coefficients, network_inputs, offsets,
    some_readings, units,
};

/// Shapes from the smallest to the largest valid size of each dimension. Some have more hidden units than the 64 that a
/// device rounds together.
const SHAPES: [Shape; 6] = [
    [1, 1, 0, 1],
    [2, 1, 3, 2],
    SMALL,
    [8, 60, MAX_ROWS - 60, MAX_UNITS],
    [3, 1, 72, 5],
    [40, MAX_ROWS, 0, 5],
];

/// Compares the coefficients and, if the recipe has an init net, the initial values.
fn compare(contents: &CompletedContents, readings: &Readings) {
    let recipe = contents.recipe();
    let completed = recipe.completed().unwrap();
    let completion = completed.coefficient_net();
    assert_eq!(completion.rows(), contents.bias.len());
    assert_eq!(completion.hidden(), contents.hidden());
    assert_eq!(completion.words(), 4 * contents.bias.len());

    // Both computations start with the same f32 inputs u, so that only the net is compared.
    let network_inputs = network_inputs(contents, &recipe, readings).into_iter();
    let network_inputs: Vec<_> = network_inputs
        .map(|u| u.map(|channels| channels.map(|channel| channel as f32)))
        .collect();
    let inputs = network_inputs.iter().map(|u| Input {
        channels: u.unwrap_or_default(),
        missing: if u.is_some() { 0.0 } else { 1.0 },
    });
    let inputs_f64 = network_inputs.iter();
    let inputs_f64 = inputs_f64.map(|u| u.map(|channels| channels.map(f64::from)));
    let expected = coefficients(contents, &inputs_f64.collect::<Vec<_>>());
    // The initial content of the memory has no effect.
    let mut state = vec![7.5; completion.words()];
    completion.compute(&inputs.collect::<Vec<_>>(), &mut state);
    let actual = completion.coefficients(&state);
    for (actual, expected) in actual.iter().zip(&expected) {
        assert_close("coefficient", actual.iter().copied(), expected);
    }

    if let Target::Descent(descent, start) = completed.target() {
        let expected = units(contents, &expected);
        let mut units = vec![0.0; start.units()];
        start.activate(actual, &mut units);
        assert_close("unit", units.iter().copied(), &expected);
        // Both computations start with the same f32 units, so that only the output layer is compared.
        let units_f64: Vec<f64> = units.iter().copied().map(f64::from).collect();
        let expected = offsets(contents, &units_f64);
        let parameters = descent.initial().len();
        let actual: Vec<f32> = (0..parameters)
            .map(|index| start.offset(index, &units))
            .collect();
        assert_close("offset", actual.iter().copied(), &expected);
        // Blocks of offsets equal single offsets.
        for first in [0, 1, parameters / 2, parameters - 1] {
            for count in 1..=9.min(parameters - first) {
                let mut offsets = vec![0.0; count];
                start.offsets(first, &units, &mut offsets);
                assert_eq!(offsets, actual[first..first + count]);
            }
        }
        // Offsets near 0 would make the comparison meaningless.
        assert!(expected.iter().any(|offset| offset.abs() > 0.01));
    }
}

#[test]
fn networks_match_formulas() {
    for shape in SHAPES {
        let [samples, ..] = shape;
        for model in [ModelKind::Linear, ModelKind::Phong, ModelKind::Neural] {
            let contents = CompletedContents::new(model, shape, MissingPolicy::Scaled);
            compare(&contents, &all_readings(samples));
        }
        let contents = CompletedContents::new(ModelKind::Linear, shape, MissingPolicy::Scaled);
        compare(&contents, &some_readings(samples, |sample| sample % 3 != 1));
    }
    // Every subset of six samples, including none and all.
    let contents = CompletedContents::small(ModelKind::Phong, MissingPolicy::Scaled);
    for present in 0..64 {
        compare(
            &contents,
            &some_readings(6, |sample| present >> sample & 1 == 1),
        );
    }
}

#[test]
fn standardization_matches_formula() {
    for brdf in [-0.0005_f32, 0.0, 1e-4, 0.03, 0.3, 2.0, 40.0] {
        for weight in [0.01_f32, 0.3, 1.0] {
            let (center, scale) = (4.25, 0.6);
            let inside = f64::from(brdf) * f64::from(weight) + 0.001;
            let expected = ((inside / 0.001).ln() - f64::from(center)) * f64::from(scale);
            let actual = f64::from(standardized(brdf, weight, center, scale));
            let error = (actual - expected).abs();
            assert!(error <= TOLERANCE, "{brdf} {weight}: {actual}, {expected}");
        }
    }
}
