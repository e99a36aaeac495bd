//! The device's forward pass agrees with the formulas, number by number.

use glimpse_core::fit::completion::{Input, Missing, standardized};
use glimpse_core::fit::{MAX_ROWS, MAX_UNITS, Target};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;

use super::made::{Made, SMALL, Shape};
use super::reference::{
    Readings, TOLERANCE, all, assert_close, coefficients, entering, fitted, offsets, units,
};

/// From one of everything to the largest that a recipe may have, and more hidden units than are rounded at once.
const SHAPES: [Shape; 6] = [
    Shape {
        samples: 1,
        components: 1,
        hidden: 0,
        units: 1,
    },
    Shape {
        samples: 2,
        components: 1,
        hidden: 3,
        units: 2,
    },
    SMALL,
    Shape {
        samples: 8,
        components: 60,
        hidden: MAX_ROWS - 60,
        units: MAX_UNITS,
    },
    Shape {
        samples: 3,
        components: 1,
        hidden: 72,
        units: 5,
    },
    Shape {
        samples: 40,
        components: MAX_ROWS,
        hidden: 0,
        units: 5,
    },
];

/// What the map makes of u, and what the start makes of that, where there is one.
fn compare(made: &Made, readings: &Readings) {
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let completed = recipe.completed().unwrap();
    let completion = completed.completion();
    assert_eq!(completion.rows(), made.bias.len());
    assert_eq!(completion.hidden(), made.hidden());
    assert_eq!(completion.words(), 4 * made.bias.len());

    // The map by itself: both begin with the same u.
    let entering: Vec<_> = entering(made, &recipe, readings)
        .into_iter()
        .map(|u| u.map(|u| u.map(|u| u as f32)))
        .collect();
    let inputs: Vec<Input<f32>> = entering
        .iter()
        .map(|u| Input {
            channels: u.unwrap_or_default(),
            missing: if u.is_some() { 0.0 } else { 1.0 },
        })
        .collect();
    let doubled: Vec<_> = entering
        .iter()
        .map(|u| u.map(|u| u.map(f64::from)))
        .collect();
    let expected = coefficients(made, &doubled);
    // What was there before does not count.
    let mut state = vec![7.5; completion.words()];
    completion.compute(&inputs, &mut state);
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
fn it_is_what_the_formulas_say() {
    for model in [ModelKind::Linear, ModelKind::Phong, ModelKind::Neural] {
        for shape in SHAPES {
            compare(
                &Made::new(model, shape, Missing::CountForMore),
                &all(shape.samples),
            );
        }
    }
}

#[test]
fn it_is_what_the_formulas_say_with_missing_readings() {
    // Every subset of six samples, none and all of them included.
    for present in 0..64_u32 {
        let made = Made::small(ModelKind::Phong, Missing::CountForMore);
        let mut readings = all(6);
        for (sample, reading) in readings.iter_mut().enumerate() {
            if present >> sample & 1 == 0 {
                *reading = None;
            }
        }
        compare(&made, &readings);
    }
    for shape in SHAPES {
        let mut readings = all(shape.samples);
        readings
            .iter_mut()
            .skip(1)
            .step_by(3)
            .for_each(|reading| *reading = None);
        compare(
            &Made::new(ModelKind::Linear, shape, Missing::CountForMore),
            &readings,
        );
    }
}

#[test]
fn a_reading_is_standardized_as_the_formula_says() {
    for brdf in [-0.0005_f32, 0.0, 1e-4, 0.03, 0.3, 2.0, 40.0] {
        for weight in [0.01_f32, 0.3, 1.0] {
            let (centre, scale) = (4.25, 0.6);
            let inside = f64::from(brdf) * f64::from(weight) + 0.001;
            let expected = ((inside / 0.001).ln() - f64::from(centre)) * f64::from(scale);
            let found = f64::from(standardized(brdf, weight, centre, scale));
            let error = (found - expected).abs();
            assert!(error <= TOLERANCE, "{brdf} {weight}: {found}, {expected}");
        }
    }
}

/// The formulas themselves say something: a weight out of place, or a reading, is told apart.
#[test]
fn the_comparison_would_notice() {
    let made = Made::small(ModelKind::Phong, Missing::CountForMore);
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let before = fitted(&made, &recipe, &all(6));
    let differs = |change: &dyn Fn(&mut Made)| {
        let mut other = made.clone();
        change(&mut other);
        let after = fitted(&other, &recipe, &all(6));
        let pairs = before.iter().zip(after);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 100.0 * 2e-6
    };
    assert!(differs(&|made| made.readings.swap(0, 1)));
    assert!(differs(&|made| made.output.swap(0, 1)));
    assert!(differs(&|made| made.centre.swap(0, 1)));
    assert!(differs(&|made| made.bias.swap(4, 5)));
    assert!(differs(&|made| made
        .then
        .as_mut()
        .unwrap()
        .1
        .hidden
        .swap(3, 4)));
    assert!(differs(&|made| made
        .then
        .as_mut()
        .unwrap()
        .1
        .output
        .swap(0, 1)));
}
