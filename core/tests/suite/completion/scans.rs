//! Whole scans: the values are those of the formulas, whatever the slices, and for the descents those
//! of their steps from there.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{AnyModel, Fitter, Linear};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{
    CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong, Samples, Slot, slot_of,
};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Scan, ScanError};

use super::made::{Made, SAMPLES};
use super::reference::{Readings, TOLERANCE, all, assert_close, fitted, residuals, some};
use crate::scanning::{MODELS, Outcome, fit};

pub(crate) type Any = AnyModel;

/// Records the readings in order.
pub(crate) fn read<K: Fitter>(scan: &mut Scan<'_, K>, readings: &Readings) {
    for (index, reading) in (0..).zip(readings) {
        if let Some(brdf) = reading {
            scan.record(index, Reading::new(*brdf)).unwrap();
        }
    }
}

/// A whole scan in memory of its own.
pub(crate) fn whole<K: Fitter>(made: &Made, readings: &Readings) -> Outcome {
    let recipe = made.recipe();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<K>::new(recipe, &mut memory).unwrap();
    read(&mut scan, readings);
    fit(&mut scan, &[u32::MAX])
}

/// The same by its model's own type.
pub(crate) fn whole_by_type(made: &Made, readings: &Readings) -> Outcome {
    match made.model() {
        ModelKind::Linear => whole::<Linear>(made, readings),
        ModelKind::Phong => whole::<Phong>(made, readings),
        ModelKind::CookTorrance => whole::<CookTorrance>(made, readings),
        ModelKind::Neural => whole::<Neural>(made, readings),
        model => panic!("{model}"),
    }
}

/// All of them, half of them, and one.
fn cases() -> [Readings; 3] {
    [
        all(SAMPLES),
        some(SAMPLES, |sample| sample % 2 == 1),
        some(SAMPLES, |sample| sample == 4),
    ]
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
fn a_fit_begins_with_the_result_of_the_formulas() {
    for kind in MODELS {
        for missing in [MissingPolicy::Unscaled, MissingPolicy::Scaled] {
            let made = without_steps(&Made::small(kind, missing));
            for readings in cases() {
                let values = whole_by_type(&made, &readings).values();
                let expected = fitted(&made, &made.recipe(), &readings);
                assert_close(kind.name(), values.into_iter(), &expected);
            }
        }
    }
}

/// K steps from there, each by the gradient of all readings at once: the same bits.
fn descends<M: Model + Fitter>() {
    let made = Made::small(M::KIND, MissingPolicy::Scaled);
    for readings in cases() {
        let start = whole::<M>(&without_steps(&made), &readings).values();
        let read = readings.iter().flatten().count();
        let places = made.recipe().pattern().zip(&readings);
        let slots = places.map(|(angles, reading)| {
            let [coordinates @ .., flags] = slot_of(
                &HalfDifference::from_angles(angles),
                reading.unwrap_or_default(),
            );
            let [hx, hz, dx, dy, dz, red, green, blue] = coordinates;
            let flags = if reading.is_some() { flags } else { 0.0 };
            [hx, hz, dx, dy, dz, red, green, blue, flags]
        });
        let slots: Vec<Slot> = slots.collect();
        let samples = Samples::new(&slots, 1.0 / (3.0 * read as f32));
        let (then, _) = made.then.as_ref().unwrap();
        let mut parameters = M::Parameters::filled(0.0);
        for (parameter, value) in parameters.as_mut_slice().iter_mut().zip(&start) {
            *parameter = *value;
        }
        for _ in 0..then.inner_steps {
            let mut gradient = M::Parameters::filled(0.0);
            M::accumulate_gradients(&parameters, samples, &mut gradient);
            let steps = gradient.as_slice().iter().zip(&then.step_sizes);
            for (parameter, (slope, size)) in parameters.as_mut_slice().iter_mut().zip(steps) {
                *parameter -= size * slope;
            }
        }
        let values = whole::<M>(&made, &readings).values();
        assert!(parameters.as_slice() == values);
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
    let made = Made::small(kind, MissingPolicy::Scaled);
    let recipe = made.recipe();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<K>::new(recipe, &mut memory).unwrap();
    for readings in cases() {
        let expected = whole_by_type(&made, &readings);
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
        let _ = scan.fit_under_way().unwrap().finish(); // which need not be plausible
        let fitted = scan.fitted().unwrap();
        assert!(fitted.values().eq(expected.values()));
        assert_eq!(fitted.residual(), expected.residual());
        assert_eq!(fitted.expected_loss(), Some(0.03));
    }
}

#[test]
fn slices_do_not_change_the_result() {
    sliced::<Linear>(ModelKind::Linear);
    sliced::<Phong>(ModelKind::Phong);
    sliced::<CookTorrance>(ModelKind::CookTorrance);
    sliced::<Neural>(ModelKind::Neural);
    for kind in MODELS {
        sliced::<Any>(kind);
    }
}

/// One memory serves recipes that complete and recipes of other models, one after the other.
#[test]
fn one_memory_serves_one_recipe_after_the_other() {
    let made = MODELS.map(|kind| Made::small(kind, MissingPolicy::Scaled).recipe());
    let words = made.iter().map(Recipe::memory_words).max().unwrap();
    let mut memory = vec![0.0; words];
    for kind in MODELS.into_iter().chain(MODELS) {
        let missing = match kind {
            ModelKind::Phong => MissingPolicy::AllRequired,
            _ => MissingPolicy::Scaled,
        };
        let made = Made::small(kind, missing);
        let mut scan = Scan::<Any>::new(made.recipe(), &mut memory).unwrap();
        read(&mut scan, &all(SAMPLES));
        let expected = whole_by_type(&made, &all(SAMPLES));
        assert_eq!(fit(&mut scan, &[5]), expected);
    }
}

#[test]
fn linears_residual_is_that_of_the_formulas() {
    let made = Made::small(ModelKind::Linear, MissingPolicy::Scaled);
    for readings in cases() {
        let outcome = whole::<Linear>(&made, &readings);
        let values: Vec<f64> = outcome.values().into_iter().map(f64::from).collect();
        let residual = outcome.residual();
        let errors = residuals(&made, &made.recipe(), &values, &readings);
        let read: Vec<f64> = errors.iter().flatten().copied().collect();
        let mean = read.iter().sum::<f64>() / read.len() as f64;
        let worst = read.iter().copied().fold(0.0, f64::max);
        for (found, expected) in [(residual.mean, mean), (residual.worst, worst)] {
            let error = (f64::from(found) - expected).abs();
            assert!(error <= 5.0 * TOLERANCE, "{found}, {expected}");
        }
        let index = usize::from(residual.worst_index);
        assert_eq!(errors[index], Some(worst));
    }
}

/// Activations end at 1, and as integers they are always numbers: the input has to be checked.
#[test]
fn a_reading_whose_logarithm_is_not_finite_diverges() {
    for kind in MODELS {
        for channel in 0..3 {
            let made = Made::small(kind, MissingPolicy::Scaled);
            let mut readings = all(SAMPLES);
            readings[2].as_mut().unwrap()[channel] = 3e38;
            assert_eq!(whole::<Any>(&made, &readings), Outcome::Diverged, "{kind}");
        }
    }
}

/// Before the scan begins.
#[test]
fn a_recipe_for_another_firmware_is_refused() {
    let (linear, phong) = (ModelKind::Linear, ModelKind::Phong);
    let [completed, started] =
        [linear, phong].map(|model| Made::small(model, MissingPolicy::Scaled).recipe());
    let needed = completed.memory_words();
    let found = needed - 1;
    let memory = Err(ScanError::Memory { needed, found });
    assert_eq!(Scan::<Linear>::accept(&completed, found), memory);
    assert_eq!(Scan::<Any>::accept(&completed, found), memory);
    // A recipe of another model, whatever completes it.
    let model = |firmware, recipe| Err(ScanError::Model { firmware, recipe });
    assert_eq!(
        Scan::<Phong>::accept(&completed, needed),
        model(phong, linear)
    );
    assert_eq!(
        Scan::<Linear>::accept(&started, 10_000),
        model(linear, phong)
    );
    let needed = started.memory_words();
    assert_eq!(Scan::<Any>::accept(&started, 10_000), Ok(needed));
}

/// A reading below the least that the logarithm takes is brought up, and does not end in a NaN.
#[test]
fn dark_readings_are_brought_up() {
    for kind in MODELS {
        let made = Made::small(kind, MissingPolicy::Scaled);
        let recipe = made.recipe();
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
        let recorded = scan.record(3, Reading::new([-0.5, 0.1, 0.1])).unwrap();
        assert!(recorded.clamped);
        let outcome = fit(&mut scan, &[5]);
        assert_eq!(outcome.residual().clamped, 1);
        // Brought up to where y w + e is e / 2, or y cos(theta_i) is -1/2.
        let (_, directions) = recipe.directions().nth(3).unwrap();
        let (cosine, other) = (directions.incoming[2], directions.outgoing[2]);
        let least = (-0.0005 / (cosine * other)).max(-0.5 / cosine);
        let found = scan.reading(3).unwrap().brdf[0];
        let error = (found - least).abs();
        assert!(error < 1e-6 * least.abs(), "{found} {least}");
        let mut readings = vec![None; SAMPLES];
        readings[3] = Some([found, 0.1, 0.1]);
        assert_eq!(whole::<Any>(&made, &readings).values(), outcome.values());
    }
}
