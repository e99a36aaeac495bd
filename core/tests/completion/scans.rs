//! Whole scans: the values are those of the formulas, whatever the slices, and for the descents those
//! of their steps from there.

use glimpse_core::fit::completion::Missing;
use glimpse_core::fit::{AnyModel, Fitter, Linear};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong, Sample};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, Memory, Reading, Residual, Scan, ScanError};

use super::made::{MODELS, Made, SAMPLES, WORDS};
use super::reference::{Readings, TOLERANCE, all, assert_close, colour, fitted, residuals};

/// Records what there is, in order.
pub(crate) fn read<K: Fitter, const CAPACITY: usize>(
    scan: &mut Scan<'_, '_, K, CAPACITY>,
    readings: &Readings,
) {
    for (index, reading) in (0..).zip(readings) {
        if let Some(brdf) = reading {
            scan.record(index, Reading::new(*brdf)).unwrap();
        }
    }
}

/// Fits in slices of these budgets, in turn: the values, and the residual.
pub(crate) fn fit<K: Fitter, const CAPACITY: usize>(
    scan: &mut Scan<'_, '_, K, CAPACITY>,
    budgets: &[u32],
) -> (Vec<f32>, Residual) {
    let mut fit = scan.fit().unwrap();
    let mut done = 0;
    for budget in budgets.iter().cycle() {
        let progress = fit.advance(*budget);
        assert!(progress.done - done <= *budget, "the slice was too long");
        done = progress.done;
        if progress.is_complete() {
            break;
        }
    }
    let fitted = fit.finish().unwrap();
    (fitted.values().collect(), fitted.residual())
}

/// A whole scan in memory of its own.
pub(crate) fn whole<K: Fitter>(made: &Made, readings: &Readings) -> (Vec<f32>, Residual) {
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    read(&mut scan, readings);
    fit(&mut scan, &[u32::MAX])
}

/// The same by its model's own type.
pub(crate) fn whole_by_name(made: &Made, readings: &Readings) -> (Vec<f32>, Residual) {
    match model(made) {
        ModelKind::Linear => whole::<Linear<WORDS>>(made, readings),
        ModelKind::Phong => whole::<Phong>(made, readings),
        ModelKind::CookTorrance => whole::<CookTorrance>(made, readings),
        ModelKind::Neural => whole::<Neural>(made, readings),
    }
}

fn model(made: &Made) -> ModelKind {
    let then = made.then.as_ref();
    then.map_or(ModelKind::Linear, |(descends, _)| descends.model)
}

/// All of them, half of them, and one.
fn cases() -> [Readings; 3] {
    let mut half = all(SAMPLES);
    half.iter_mut()
        .step_by(2)
        .for_each(|reading| *reading = None);
    let mut one = vec![None; SAMPLES];
    one[4] = Some(colour(4));
    [all(SAMPLES), half, one]
}

/// A recipe whose steps are of size 0, so that its fit ends where it begins.
fn without_steps(made: &Made) -> Made {
    let mut made = made.clone();
    if let Some((descends, _)) = &mut made.then {
        descends.step_sizes.fill(0.0);
    }
    made
}

#[test]
fn a_fit_begins_with_what_the_formulas_say() {
    for kind in MODELS {
        let made = without_steps(&Made::small(kind, Missing::CountForMore));
        let bytes = made.write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        assert_eq!(recipe.model(), kind);
        for readings in cases() {
            let (values, _) = whole_by_name(&made, &readings);
            let expected = fitted(&made, &recipe, &readings);
            assert_close(kind.name(), values.into_iter(), &expected);
        }
    }
}

/// K steps from there, each by the gradient of all readings at once: the same bits.
fn descends<M: Model>() {
    let made = Made::small(M::KIND, Missing::CountForMore);
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    for readings in cases() {
        let (start, _) = whole::<M>(&without_steps(&made), &readings);
        let read = readings.iter().flatten().count();
        let samples: Vec<Sample<f32>> = recipe
            .pattern()
            .zip(&readings)
            .map(|(angles, reading)| Sample {
                at: HalfDifference::from_angles(angles),
                measured: reading.unwrap_or_default(),
                weight: reading.map_or(0.0, |_| 1.0 / (3.0 * read as f32)),
            })
            .collect();
        let (then, _) = made.then.as_ref().unwrap();
        let mut parameters = M::ZEROS;
        for (parameter, value) in parameters.iter_mut().zip(&start) {
            *parameter = *value;
        }
        for _ in 0..then.inner_steps {
            let mut gradient = M::ZEROS;
            M::accumulate_gradients(&parameters, &samples, &mut gradient);
            let steps = gradient.iter().zip(&then.step_sizes);
            for (parameter, (slope, size)) in parameters.iter_mut().zip(steps) {
                *parameter -= size * slope;
            }
        }
        let (values, _) = whole::<M>(&made, &readings);
        let expected: Vec<f32> = parameters.iter().copied().collect();
        assert_eq!(values, expected);
        assert_ne!(values, start);
    }
}

#[test]
fn a_descent_goes_on_from_there() {
    descends::<Phong>();
    descends::<CookTorrance>();
    descends::<Neural>();
}

fn sliced<K: Fitter>(kind: ModelKind) {
    let made = Made::small(kind, Missing::CountForMore);
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for readings in cases() {
        let expected = whole_by_name(&made, &readings);
        scan.restart();
        read(&mut scan, &readings);
        // A reading, the hidden units and a channel are a unit each; so are the start's units, and
        // 64 parameters. Then come three rounds of gradients.
        let start = kind.parameters().map_or(0, |parameters| {
            let started = parameters.div_ceil(64) as u32;
            1 + started + 3 * SAMPLES as u32
        });
        let total = scan.fit().unwrap().progress().total;
        assert_eq!(total, SAMPLES as u32 + 1 + 3 + start);
        for budgets in [&[1][..], &[2, 3], &[7], &[1, 100], &[u32::MAX]] {
            assert_eq!(fit(&mut scan, budgets), expected);
        }
        // The same where each slice is found again.
        assert_eq!(scan.fit().unwrap().progress().done, 0);
        while !scan.fit_under_way().unwrap().advance(3).is_complete() {}
        let fitted = scan.fit_under_way().unwrap().finish().unwrap();
        assert!(fitted.values().eq(expected.0));
        assert_eq!(fitted.residual(), expected.1);
        assert_eq!(fitted.expected_loss(), Some(0.03));
    }
}

#[test]
fn slices_do_not_change_the_result() {
    sliced::<Linear<WORDS>>(ModelKind::Linear);
    sliced::<Phong>(ModelKind::Phong);
    sliced::<CookTorrance>(ModelKind::CookTorrance);
    sliced::<Neural>(ModelKind::Neural);
}

#[test]
fn any_model_fits_the_same_bits() {
    for kind in MODELS {
        sliced::<AnyModel<WORDS>>(kind);
    }
}

/// One memory serves recipes that complete and recipes of other models, one after the other.
#[test]
fn one_memory_serves_one_recipe_after_the_other() {
    let recipes: Vec<(Made, Vec<u8>)> = MODELS
        .into_iter()
        .map(|kind| {
            let missing = match kind {
                ModelKind::Phong => Missing::NoFit,
                _ => Missing::CountForMore,
            };
            let made = Made::small(kind, missing);
            let bytes = made.write().unwrap();
            (made, bytes)
        })
        .collect();
    let mut memory = Memory::<AnyModel<WORDS>, SAMPLES>::new();
    for _ in 0..2 {
        for (made, bytes) in &recipes {
            let recipe = Recipe::parse(bytes).unwrap();
            let mut scan = Scan::new(recipe, &mut memory).unwrap();
            read(&mut scan, &all(SAMPLES));
            let expected = whole_by_name(made, &all(SAMPLES));
            assert_eq!(fit(&mut scan, &[5]), expected);
        }
    }
}

#[test]
fn linears_residual_is_that_of_the_formulas() {
    let made = Made::small(ModelKind::Linear, Missing::CountForMore);
    let bytes = made.write().unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    for readings in cases() {
        let (values, residual) = whole::<Linear<WORDS>>(&made, &readings);
        let values: Vec<f64> = values.into_iter().map(f64::from).collect();
        let errors = residuals(&made, &recipe, &values, &readings);
        let read: Vec<f64> = errors.iter().flatten().copied().collect();
        let mean = read.iter().sum::<f64>() / read.len() as f64;
        let worst = read.iter().copied().fold(0.0, f64::max);
        let found = f64::from(residual.mean);
        assert!((found - mean).abs() <= 5.0 * TOLERANCE, "{found}, {mean}");
        let found = f64::from(residual.worst);
        assert!((found - worst).abs() <= 5.0 * TOLERANCE, "{found}, {worst}");
        let index = usize::from(residual.worst_index);
        assert_eq!(errors[index], Some(worst));
    }
}

/// Not in a fit of what is left of it: activations end at 1, and as integers they are always numbers.
#[test]
fn a_reading_whose_logarithm_is_no_number_ends_in_no_fit() {
    for kind in MODELS {
        for channel in 0..3 {
            let made = Made::small(kind, Missing::CountForMore);
            let bytes = made.write().unwrap();
            let recipe = Recipe::parse(&bytes).unwrap();
            let mut memory = Memory::<AnyModel<WORDS>, SAMPLES>::new();
            let mut scan = Scan::new(recipe, &mut memory).unwrap();
            let mut readings = all(SAMPLES);
            readings[2].as_mut().unwrap()[channel] = 3e38;
            read(&mut scan, &readings);
            let mut fit = scan.fit().unwrap();
            while !fit.advance(u32::MAX).is_complete() {}
            assert_eq!(fit.finish().err(), Some(FinishError::Diverged), "{kind}");
        }
    }
}

/// Where it does not fit, the scan says so before it begins.
#[test]
fn what_there_is_no_room_for_is_refused() {
    let bytes = Made::small(ModelKind::Linear, Missing::CountForMore)
        .write()
        .unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<Linear<{ WORDS - 1 }>, SAMPLES>::new();
    let (needed, found) = (WORDS, WORDS - 1);
    let error = Scan::new(recipe, &mut memory).err();
    assert_eq!(error, Some(ScanError::Words { needed, found }));
    let mut memory = Memory::<AnyModel<{ WORDS - 1 }>, SAMPLES>::new();
    let error = Scan::new(recipe, &mut memory).err();
    assert_eq!(error, Some(ScanError::Words { needed, found }));

    // A model of another name is none of this firmware's, whatever completes it.
    let mut memory = Memory::<Phong, SAMPLES>::new();
    let (firmware, recipe_model) = (ModelKind::Phong, ModelKind::Linear);
    let error = ScanError::Model {
        firmware,
        recipe: recipe_model,
    };
    assert_eq!(Scan::new(recipe, &mut memory).err(), Some(error));
    let bytes = Made::small(ModelKind::Phong, Missing::CountForMore)
        .write()
        .unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<Linear<WORDS>, SAMPLES>::new();
    let (firmware, recipe_model) = (ModelKind::Linear, ModelKind::Phong);
    let error = ScanError::Model {
        firmware,
        recipe: recipe_model,
    };
    assert_eq!(Scan::new(recipe, &mut memory).err(), Some(error));
    let mut memory = Memory::<AnyModel<0>, SAMPLES>::new();
    assert!(Scan::new(recipe, &mut memory).is_ok());
}
