//! Fits match the formulas in f64, for every legal combination of stages and any slices of work.

use glimpse_core::fit::{Linear, ScanModel};
use glimpse_core::gonio::Reading;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::scan::{Fitted, Scan};

use crate::recipes::*;
use crate::reference::{Readings, color, estimate};
use crate::scanning::{Any, Outcome, fit};

/// The largest error of f32 compared with f64, relative to the larger of 1 and the number.
///
/// A mapped reading has an error of about 1e-6 in f32. With micromath it is 5e-4, due to exponentials with an error of
/// 2.4e-3. A system with precisions from p multiplies it by at most 1 / (2 sqrt(p)), which is 5 for p = 0.01.
pub(crate) const TOLERANCE: f64 = by_math!(2e-5, 2e-2);

/// The readings of some of n samples.
pub(crate) fn readings(samples: usize, is_read: impl Fn(usize) -> bool) -> Readings {
    let samples = 0..samples;
    samples
        .map(|sample| is_read(sample).then(|| color(sample)))
        .collect()
}

fn gray(readings: &Readings) -> Readings {
    let gray = readings
        .iter()
        .map(|reading| reading.map(|[red, ..]| [red; 3]));
    gray.collect()
}

/// All readings, gray ones and, if the fit tolerates that, some of them.
fn cases(contents: &Contents) -> Vec<Readings> {
    let all = readings(contents.samples(), |_| true);
    let mut cases = vec![gray(&all), all];
    if contents.net.is_some() {
        cases.push(readings(contents.samples(), |sample| sample % 2 == 1));
        cases.push(gray(&readings(contents.samples(), |sample| sample != 2)));
        cases.push(readings(contents.samples(), |sample| sample == 4));
    }
    cases
}

/// Calls `check` with a scan that has these readings, and with the outcome of its fit.
pub(crate) fn with_fit<K: ScanModel>(
    contents: &Contents,
    readings: &Readings,
    budgets: &[u32],
    check: impl FnOnce(&mut Scan<'_, K>, Outcome),
) {
    let recipe = contents.recipe();
    // A fit initializes all the words that it reads.
    let mut memory = vec![f32::NAN; recipe.memory_words()];
    let mut scan = Scan::<K>::new(recipe, &mut memory).unwrap();
    for (index, reading) in (0..).zip(readings) {
        if let Some(brdf) = reading {
            scan.record(index, Reading::new(*brdf)).unwrap();
        }
    }
    let outcome = fit(&mut scan, budgets);
    check(&mut scan, outcome);
}

pub(crate) fn outcome(contents: &Contents, readings: &Readings) -> Outcome {
    let mut outcome = Outcome::Diverged;
    with_fit::<Any>(contents, readings, &[9], |_, actual| outcome = actual);
    outcome
}

/// Checks that two numbers are equal within a multiple of [`TOLERANCE`].
#[track_caller]
fn assert_close(name: &str, factor: f64, actual: f32, expected: f64) {
    let error = (f64::from(actual) - expected).abs() / expected.abs().max(1.0);
    assert!(
        error <= factor * TOLERANCE,
        "{name}: {actual} instead of {expected}, error {error:.1e}"
    );
}

/// Gray readings give a gray material, to the bit: at the pattern or, for Linear, in the coefficients.
fn assert_gray<K: ScanModel>(name: &str, contents: &Contents, fitted: &Fitted<'_, K>) {
    let values: Vec<f32> = fitted.values().collect();
    if contents.model() == ModelKind::Linear {
        let components = values.len() / 3;
        assert_eq!(values, values[..components].repeat(3), "{name}");
    }
    for (_, directions) in contents.recipe().directions() {
        let brdf = fitted.brdf(&directions).map(|brdf| brdf.map(f32::to_bits));
        let is_valid = brdf.is_none_or(|[red, green, blue]| red == green && green == blue);
        assert!(is_valid, "{name}");
    }
}

fn check<K: ScanModel>(name: &str, contents: &Contents) {
    for readings in cases(contents) {
        let expected = estimate(contents, &readings);
        with_fit::<K>(contents, &readings, &[u32::MAX], |scan, outcome| {
            let values = outcome.values();
            assert_eq!(values.len(), expected.values.len(), "{name}");
            for (index, (actual, expected)) in values.iter().zip(&expected.values).enumerate() {
                assert_close(&format!("{name}, value {index}"), 1.0, *actual, *expected);
            }
            let residual = outcome.residual();
            let worst = expected.errors[usize::from(residual.worst_index)].unwrap();
            assert_close(name, 5.0, residual.mean, expected.mean_error());
            assert_close(name, 5.0, residual.worst, worst);
            let fitted = scan.fitted().unwrap();
            if gray(&readings) == readings {
                assert_gray(name, contents, &fitted);
            }
            let loss = fitted.predicted_loss();
            assert_eq!(loss.is_some(), expected.predicted_loss.is_some());
            if let Some((loss, expected)) = loss.zip(expected.predicted_loss) {
                assert_close(name, 20.0, loss / expected as f32, 1.0);
            }
            let prediction = contents.prediction.as_ref();
            let present = readings.iter().flatten().count();
            let bound = prediction.map(|prediction| match &prediction.partial_bound[..] {
                [] => prediction.bound,
                bounds => bounds[present - 1],
            });
            let bound = bound.map(|bound| loss.unwrap() * bound);
            assert_eq!(fitted.loss_bound(), bound);
        });
        // The result does not depend on the slices, nor on the type of the model.
        let expected = outcome(contents, &readings);
        for budgets in [&[1][..], &[2, 3], &[1, 100]] {
            with_fit::<K>(contents, &readings, budgets, |_, actual| {
                assert_eq!(actual, expected)
            });
        }
    }
}

fn check_by_type(name: &str, contents: &Contents) {
    match contents.model() {
        ModelKind::Phong => check::<Phong>(name, contents),
        ModelKind::CookTorrance => check::<CookTorrance>(name, contents),
        ModelKind::Neural => check::<Neural>(name, contents),
        _ => check::<Linear>(name, contents),
    }
}

#[test]
fn fits_match_formulas() {
    for (name, contents) in combinations() {
        check_by_type(&name, &contents);
        if contents.ridge.is_some() {
            let mut predicted = contents.predicted();
            check_by_type(&name, &predicted);
            let prediction = predicted.prediction.as_mut().unwrap();
            (prediction.partial_loss, prediction.partial_bound) = (Vec::new(), Vec::new());
            check_by_type(&name, &predicted);
        }
    }
}

/// The smallest and largest nets, and more hidden units than the 64 that a device rounds together.
#[test]
fn fits_match_formulas_for_all_sizes() {
    for (samples, coefficients, hidden, units) in [
        (5, 1, 0, 1),
        (6, 1, 3, 2),
        (8, 60, 36, 32),
        (7, 1, 72, 5),
        (40, 96, 0, 5),
    ] {
        let components = coefficients + usize::from(hidden > 3);
        let shape = Shape {
            samples,
            components,
            coefficients,
            hidden,
            units,
            virtual_readings: 1,
        };
        for model in [None, Some(ModelKind::Phong)] {
            check_by_type(&format!("{shape:?}"), &random_recipe(shape, model));
        }
    }
}

/// With all readings, the treatment of missing ones has no effect.
#[test]
fn missing_policies_agree_on_all_readings() {
    for mut contents in tolerant() {
        let all = readings(SAMPLES, |_| true);
        let expected = outcome(&contents, &all);
        contents.net.as_mut().unwrap().missing = 0;
        assert_eq!(outcome(&contents, &all), expected);
        assert!(!contents.recipe().tolerates_missing());
    }
}

/// The units of work of the document of costs.
#[test]
fn units_of_work_match_stages() {
    for (name, contents) in combinations() {
        let n = contents.samples();
        let mut total = 17 + n; // the checks
        total += contents.net.as_ref().map_or(0, |_| n + 1 + 3);
        if let Some(ridge) = &contents.ridge {
            let rows = n.min(ridge.precision.len());
            let has_means = !ridge.difference_precision.is_empty();
            total += n + if has_means { 2 * rows + 4 } else { rows + 3 };
        }
        if let Some(sgd) = &contents.sgd {
            total += usize::from(sgd.steps) * n;
        }
        if let Some(steps) = &contents.gauss_newton {
            let systems = if contents.model() == ModelKind::Neural {
                3
            } else {
                1
            };
            total += 1 + steps.initial.len().div_ceil(64);
            total += usize::from(steps.steps) * (n + steps.center.len() + systems);
        }
        with_fit::<Any>(&contents, &readings(n, |_| true), &[u32::MAX], |scan, _| {
            assert_eq!(
                scan.fit().unwrap().progress().total as usize,
                total,
                "{name}"
            );
        });
    }
}

/// The comparison finds an innovation 5 % above that of the training materials, and not one 5 % below.
#[test]
fn innovation_above_training_is_unlike() {
    for mut contents in tolerant() {
        for is_read in [
            |_: usize| true,
            |sample| sample % 2 == 1,
            |sample| sample == 4,
        ] {
            let readings = readings(SAMPLES, is_read);
            let innovation = estimate(&contents, &readings).innovation;
            for (factor, expected) in [(0.95, true), (1.05, false)] {
                let prediction = contents.prediction.as_mut().unwrap();
                prediction.max_innovation = (factor * innovation) as f32;
                with_fit::<Any>(&contents, &readings, &[9], |scan, _| {
                    let is_unlike = scan.fitted().unwrap().is_unlike_training();
                    assert_eq!(is_unlike, Some(expected));
                });
            }
        }
    }
}

/// A loss or a bound that overflows is unknown. Without a prediction, all estimates are.
#[test]
fn infinite_estimate_is_none() {
    let all = readings(SAMPLES, |_| true);
    let estimates = |contents: &Contents| {
        let mut estimates = (None, None, None);
        with_fit::<Any>(contents, &all, &[9], |scan, _| {
            let fitted = scan.fitted().unwrap();
            let is_unlike = fitted.is_unlike_training();
            estimates = (fitted.predicted_loss(), fitted.loss_bound(), is_unlike);
        });
        estimates
    };
    for mut contents in tolerant() {
        assert!(contents.recipe().bounds_partial_loss());
        let prediction = contents.prediction.as_mut().unwrap();
        prediction.partial_loss.fill(80.0);
        prediction.partial_bound.fill(f32::MAX);
        let (loss, bound, is_unlike) = estimates(&contents);
        assert!(loss.unwrap() > 1.0 && bound.is_none() && is_unlike.is_some());
        contents.prediction.as_mut().unwrap().weights[0] = 1e3;
        assert_eq!(estimates(&contents).0, None);
        contents.prediction.as_mut().unwrap().partial_bound.clear();
        assert!(!contents.recipe().bounds_partial_loss());
        contents.prediction = None;
        assert_eq!(estimates(&contents), (None, None, None));
    }
}

/// Overflows are reported, also where later activations of at most 1 or a minimum with 0 would hide them.
#[test]
fn overflow_diverges() {
    let assert_diverges = |name: &str, contents: &Contents, readings: &Readings| {
        assert_eq!(outcome(contents, readings), Outcome::Diverged, "{name}");
    };
    let all = readings(SAMPLES, |_| true);
    for (name, contents) in combinations()
        .into_iter()
        .filter(|(_, all)| all.samples() == SAMPLES)
    {
        for channel in 0..3 {
            let mut readings = all.clone();
            readings[2].as_mut().unwrap()[channel] = 3e38;
            assert_diverges(&name, &contents, &readings);
        }
        let mut other = contents;
        if let Some(steps) = &mut other.gauss_newton {
            // The exponential of a virtual reading.
            steps.center.fill(100.0);
            assert_diverges(&name, &other, &all);
        }
    }
}
