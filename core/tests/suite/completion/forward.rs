//! The device's forward pass agrees with the formulas, number by number.

use glimpse_core::fit::coefficient_net::{Input, MissingPolicy, standardized};
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS, Target};
use glimpse_core::model::ModelKind;

use super::made::{Made, SMALL, Shape};
use super::reference::{
    Readings, TOLERANCE, all, assert_close, coefficients, entering, fitted, offsets, some, units,
};

/// From one of everything to the largest that a recipe may have, and more hidden units than are rounded at once.
const SHAPES: [Shape; 6] = [
    [1, 1, 0, 1],
    [2, 1, 3, 2],
    SMALL,
    [8, 60, MAX_ROWS - 60, MAX_UNITS],
    [3, 1, 72, 5],
    [40, MAX_ROWS, 0, 5],
];

/// Compares the output of the map for u, and the start that follows from it, where there is one.
fn compare(made: &Made, readings: &Readings) {
    let recipe = made.recipe();
    let completed = recipe.completed().unwrap();
    let completion = completed.coefficient_net();
    assert_eq!(completion.rows(), made.bias.len());
    assert_eq!(completion.hidden(), made.hidden());
    assert_eq!(completion.words(), 4 * made.bias.len());

    // The map by itself: both begin with the same u.
    let entering = entering(made, &recipe, readings).into_iter();
    let entering: Vec<_> = entering.map(|u| u.map(|u| u.map(|u| u as f32))).collect();
    let inputs = entering.iter().map(|u| Input {
        channels: u.unwrap_or_default(),
        missing: if u.is_some() { 0.0 } else { 1.0 },
    });
    let doubled = entering.iter().map(|u| u.map(|u| u.map(f64::from)));
    let expected = coefficients(made, &doubled.collect::<Vec<_>>());
    // Earlier content of the memory does not count.
    let mut state = vec![7.5; completion.words()];
    completion.compute(&inputs.collect::<Vec<_>>(), &mut state);
    let found = completion.coefficients(&state);
    for (found, expected) in found.iter().zip(&expected) {
        assert_close("coefficient", found.iter().copied(), expected);
    }

    if let Target::Descent(descent, start) = completed.target() {
        let expected = units(made, &expected);
        let mut units = vec![0.0; start.units()];
        start.activate(found, &mut units);
        assert_close("unit", units.iter().copied(), &expected);
        // By the device's own units, so that both round the same numbers.
        let own: Vec<f64> = units.iter().copied().map(f64::from).collect();
        let expected = offsets(made, &own);
        let parameters = descent.initial().len();
        let found: Vec<f32> = (0..parameters)
            .map(|index| start.offset(index, &units))
            .collect();
        assert_close("offset", found.iter().copied(), &expected);
        // Several at a time they are the same, wherever those begin and end.
        for first in [0, 1, parameters / 2, parameters - 1] {
            for count in 1..=9.min(parameters - first) {
                let mut offsets = vec![0.0; count];
                start.offsets(first, &units, &mut offsets);
                assert_eq!(offsets, found[first..first + count]);
            }
        }
        // The start adds something to speak of.
        assert!(expected.iter().any(|offset| offset.abs() > 0.01));
    }
}

#[test]
fn the_map_and_the_start_follow_their_formulas() {
    for shape in SHAPES {
        let [samples, ..] = shape;
        for model in [ModelKind::Linear, ModelKind::Phong, ModelKind::Neural] {
            let made = Made::new(model, shape, MissingPolicy::Scaled);
            compare(&made, &all(samples));
        }
        let made = Made::new(ModelKind::Linear, shape, MissingPolicy::Scaled);
        compare(&made, &some(samples, |sample| sample % 3 != 1));
    }
    // Every subset of six samples, none and all of them included.
    let made = Made::small(ModelKind::Phong, MissingPolicy::Scaled);
    for present in 0..64 {
        compare(&made, &some(6, |sample| present >> sample & 1 == 1));
    }
}

#[test]
fn a_reading_is_standardized_by_its_formula() {
    for brdf in [-0.0005_f32, 0.0, 1e-4, 0.03, 0.3, 2.0, 40.0] {
        for weight in [0.01_f32, 0.3, 1.0] {
            let (center, scale) = (4.25, 0.6);
            let inside = f64::from(brdf) * f64::from(weight) + 0.001;
            let expected = ((inside / 0.001).ln() - f64::from(center)) * f64::from(scale);
            let found = f64::from(standardized(brdf, weight, center, scale));
            let error = (found - expected).abs();
            assert!(error <= TOLERANCE, "{brdf} {weight}: {found}, {expected}");
        }
    }
}

/// The formulas themselves depend on the place of every weight.
#[test]
fn the_comparison_notices_a_weight_out_of_place() {
    let made = Made::small(ModelKind::Phong, MissingPolicy::Scaled);
    let recipe = made.recipe();
    let before = fitted(&made, &recipe, &all(6));
    let changes: [fn(&mut Made); 6] = [
        |made| made.readings.swap(0, 1),
        |made| made.output.swap(0, 1),
        |made| made.center.swap(0, 1),
        |made| made.bias.swap(4, 5),
        |made| made.then.as_mut().unwrap().1.hidden.swap(3, 4),
        |made| made.then.as_mut().unwrap().1.output.swap(0, 1),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut other = made.clone();
        change(&mut other);
        let after = fitted(&other, &recipe, &all(6));
        let pairs = before.iter().zip(after);
        let difference = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference > 100.0 * 2e-6, "change {index}");
    }
}
