//! Full scans: the values match the formulas for any slicing. Descents continue from them.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{AnyModel, Linear, ScanModel};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{
    CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong, Samples, Slot, slot_of,
};
use glimpse_core::recipe::MAX_MEAN;
use glimpse_core::scan::{Reading, Scan};

use super::contents::{CORRECTED, CompletedContents, SAMPLES, VIRTUAL_READINGS};
use super::reference::{Readings, TOLERANCE, all_readings, residuals, some_readings};
use crate::scanning::{Outcome, fit};

pub(crate) type Any = AnyModel;

/// Records the readings in order.
pub(crate) fn record_readings<K: ScanModel>(scan: &mut Scan<'_, K>, readings: &Readings) {
    for (index, reading) in (0..).zip(readings) {
        if let Some(brdf) = reading {
            scan.record(index, Reading::new(*brdf)).unwrap();
        }
    }
}

/// A full scan in its own memory.
pub(crate) fn full_scan<K: ScanModel>(
    contents: &CompletedContents,
    readings: &Readings,
) -> Outcome {
    let recipe = contents.recipe();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<K>::new(recipe, &mut memory).unwrap();
    record_readings(&mut scan, readings);
    fit(&mut scan, &[u32::MAX])
}

/// A full scan with the type of the recipe's model.
pub(crate) fn full_scan_by_type(contents: &CompletedContents, readings: &Readings) -> Outcome {
    match contents.model() {
        ModelKind::Linear => full_scan::<Linear>(contents, readings),
        ModelKind::Phong => full_scan::<Phong>(contents, readings),
        ModelKind::CookTorrance => full_scan::<CookTorrance>(contents, readings),
        ModelKind::Neural => full_scan::<Neural>(contents, readings),
        model => panic!("{model}"),
    }
}

/// All readings, half of them, and one.
pub(crate) fn cases() -> [Readings; 3] {
    [
        all_readings(SAMPLES),
        some_readings(SAMPLES, |sample| sample % 2 == 1),
        some_readings(SAMPLES, |sample| sample == 4),
    ]
}

/// A recipe with steps of size 0, so that its fit ends with the initial values.
pub(crate) fn without_steps(contents: &CompletedContents) -> CompletedContents {
    let mut contents = contents.clone();
    if let Some(descent_part) = &mut contents.descent {
        descent_part.step_sizes.fill(0.0);
    }
    contents
}

/// Compares a fit with steps from the initial values, each with the gradient of all readings. The bits are equal.
fn check_descent<M: Model + ScanModel>() {
    let contents = CompletedContents::small(M::KIND, MissingPolicy::Scaled);
    for readings in cases() {
        let start = full_scan::<M>(&without_steps(&contents), &readings).values();
        let read = readings.iter().flatten().count();
        let pattern = contents.recipe().pattern().zip(&readings);
        let slots = pattern.map(|(angles, reading)| {
            let [coordinates @ .., flags] = slot_of(
                &HalfDifference::from_angles(angles),
                reading.unwrap_or_default(),
            );
            let [hx, hz, dx, dy, dz, red, green, blue, min] = coordinates;
            let flags = if reading.is_some() { flags } else { 0.0 };
            [hx, hz, dx, dy, dz, red, green, blue, min, flags]
        });
        let slots: Vec<Slot> = slots.collect();
        let samples = Samples::new(&slots, 1.0 / (3.0 * read as f32));
        let descent = contents.descent.as_ref().unwrap();
        let mut parameters = M::Parameters::filled(0.0);
        for (parameter, value) in parameters.as_mut_slice().iter_mut().zip(&start) {
            *parameter = *value;
        }
        for _ in 0..descent.inner_steps {
            let mut gradient = M::Parameters::filled(0.0);
            M::accumulate_gradients(&parameters, samples, &mut gradient);
            let steps = gradient.as_slice().iter().zip(&descent.step_sizes);
            for (parameter, (derivative, step_size)) in
                parameters.as_mut_slice().iter_mut().zip(steps)
            {
                *parameter -= step_size * derivative;
            }
        }
        let values = full_scan::<M>(&contents, &readings).values();
        assert!(parameters.as_slice() == values);
        assert_ne!(values, start);
    }
}

#[test]
fn descent_continues_from_initial_values() {
    check_descent::<Phong>();
    check_descent::<CookTorrance>();
    check_descent::<Neural>();
}

/// The units of work of a fit.
///
/// The completion has one for each reading, one for the hidden units, and one for each channel. A correction has one for
/// each reading, each component and each channel. An init net has one for its units and one for each 64 parameters.
/// Gradients have one for each reading. A Gauss-Newton step has one for each reading, virtual or not, and for each system.
fn units_of_work(contents: &CompletedContents) -> usize {
    let mut total = SAMPLES + 1 + 3;
    if contents.correction.is_some() {
        total += SAMPLES + contents.fitted_components() + 3;
    }
    if contents.init_net.is_some() {
        total += 1 + contents.initial().len().div_ceil(64);
    }
    if let Some(descent_part) = &contents.descent {
        total += usize::from(descent_part.inner_steps) * SAMPLES;
    }
    if let Some(steps_part) = &contents.gauss_newton {
        let systems = if contents.model() == ModelKind::Neural {
            3
        } else {
            1
        };
        total += usize::from(steps_part.steps) * (SAMPLES + VIRTUAL_READINGS + systems);
    }
    total
}

fn check_slices<K: ScanModel>(contents: &CompletedContents) {
    let recipe = contents.recipe();
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<K>::new(recipe, &mut memory).unwrap();
    for readings in cases() {
        let expected = full_scan_by_type(contents, &readings);
        scan.restart();
        record_readings(&mut scan, &readings);
        let total = scan.fit().unwrap().progress().total;
        assert_eq!(total as usize, units_of_work(contents) + 17 + SAMPLES); // with the checks
        for budgets in [&[1][..], &[2, 3], &[7], &[1, 100], &[u32::MAX]] {
            assert_eq!(fit(&mut scan, budgets), expected);
        }
        assert_eq!(scan.fitted().unwrap().expected_loss(), Some(0.03));
    }
}

#[test]
fn slicing_keeps_result() {
    for contents in CompletedContents::all_small(MissingPolicy::Scaled) {
        match contents.model() {
            ModelKind::Phong => check_slices::<Phong>(&contents),
            ModelKind::CookTorrance => check_slices::<CookTorrance>(&contents),
            ModelKind::Neural => check_slices::<Neural>(&contents),
            _ => check_slices::<Linear>(&contents),
        }
        check_slices::<Any>(&contents);
    }
}

#[test]
fn linear_residual_matches_formula() {
    let plain = CompletedContents::small(ModelKind::Linear, MissingPolicy::Scaled);
    let corrected = plain.clone().corrected(CORRECTED);
    for (contents, readings) in [plain, corrected]
        .iter()
        .flat_map(|contents| cases().map(|readings| (contents, readings)))
    {
        let outcome = full_scan::<Linear>(contents, &readings);
        let values: Vec<f64> = outcome.values().into_iter().map(f64::from).collect();
        let residual = outcome.residual();
        let errors = residuals(contents, &contents.recipe(), &values, &readings);
        let read: Vec<f64> = errors.iter().flatten().copied().collect();
        let mean = read.iter().sum::<f64>() / read.len() as f64;
        let worst = read.iter().copied().fold(0.0, f64::max);
        for (actual, expected) in [(residual.mean, mean), (residual.worst, worst)] {
            let error = (f64::from(actual) - expected).abs();
            assert!(error <= 5.0 * TOLERANCE, "{actual}, {expected}");
        }
        let index = usize::from(residual.worst_index);
        assert_eq!(errors[index], Some(worst));
    }
}

/// Overflows are reported, also where later activations of at most 1 or a minimum with 0 would hide them.
#[test]
fn overflow_diverges() {
    let assert_diverges = |contents: &CompletedContents, readings: &Readings| {
        let outcome = full_scan::<Any>(contents, readings);
        assert_eq!(outcome, Outcome::Diverged, "{}", contents.model());
    };
    let readings = all_readings(SAMPLES);
    for contents in CompletedContents::all_small(MissingPolicy::Scaled) {
        for channel in 0..3 {
            let mut readings = readings.clone();
            readings[2].as_mut().unwrap()[channel] = 3e38;
            assert_diverges(&contents, &readings);
        }
        // The squares of the components.
        let mut other = contents.clone();
        if let Some(correction_part) = &mut other.correction {
            correction_part.row_scales.fill(1e30);
            assert_diverges(&other, &readings);
        }
        // The exponential of a virtual reading.
        let mut other = contents;
        if let Some(steps_part) = &mut other.gauss_newton {
            steps_part.center.fill(MAX_MEAN);
            assert_diverges(&other, &readings);
        }
    }
}

/// A BRDF of Linear that is NaN at a sample does not count as 0. All coefficients are finite.
#[test]
fn nan_at_sample_diverges() {
    let mut contents = CompletedContents::small(ModelKind::Linear, MissingPolicy::Scaled);
    contents.readings.fill(0);
    contents.output.fill(0);
    contents.bias.fill(1.0); // coefficients of 1
    contents.row_scales.fill(f32::MAX);
    for weight in [0, 127] {
        // The sum of both products is infinity minus infinity, or 0.
        for row in contents.rows.as_chunks_mut().0 {
            *row = [weight, -weight, 0, 0];
        }
        let outcome = full_scan::<Linear>(&contents, &all_readings(SAMPLES));
        assert_eq!(outcome == Outcome::Diverged, weight != 0);
    }
}

/// A reading that would make the argument of a logarithm negative is clamped, and does not give a NaN.
#[test]
fn clamps_dark_readings() {
    for contents in CompletedContents::all_small(MissingPolicy::Scaled) {
        let recipe = contents.recipe();
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
        let recorded = scan.record(3, Reading::new([-0.5, 0.1, 0.1])).unwrap();
        assert!(recorded.clamped);
        let outcome = fit(&mut scan, &[5]);
        assert_eq!(outcome.residual().clamped, 1);
        // At the bound, y w + e is e / 2, or y cos(theta_i) is -1/2.
        let (_, directions) = recipe.directions().nth(3).unwrap();
        let (cosine, other) = (directions.incoming[2], directions.outgoing[2]);
        let min = (-0.0005 / (cosine * other)).max(-0.5 / cosine);
        let angles = recipe.pattern().nth(3).unwrap();
        let actual = recipe
            .method()
            .min_reading(3, &HalfDifference::from_angles(angles));
        let error = (actual - min).abs();
        assert!(error < 1e-6 * min.abs(), "{actual} {min}");
        // The reading itself stays as it was.
        assert_eq!(scan.reading(3).unwrap().brdf[0], -0.5);
        let mut readings = vec![None; SAMPLES];
        readings[3] = Some([actual, 0.1, 0.1]);
        assert_eq!(
            full_scan::<Any>(&contents, &readings).values(),
            outcome.values()
        );
    }
}
