//! Gauss-Newton steps match their formulas in f64, for every model with steps, with and without missing readings.

use glimpse_core::fit::ScanModel;
use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong};
use glimpse_core::recipe::MAX_READING_WEIGHT;
use proptest::prelude::*;

use super::contents::{CORRECTED, CompletedContents, GaussNewtonPart, SAMPLES, VIRTUAL_READINGS};
use super::reference::{
    Readings, SYSTEM_TOLERANCE, add_row, all_readings, assert_within, brdf_of, diagonal,
    expected_values, fitted_coefficients, scaled, solve,
};
use super::scans::{Any, cases, full_scan};
use crate::scanning::Outcome;

/// A reading with its weight u.
struct WeightedReading {
    at: HalfDifference<f64>,
    measured: [f64; 3],
    weight: f64,
}

fn half_difference([theta_h, theta_d, phi_d]: [f32; 3]) -> HalfDifference<f64> {
    let [theta_h, theta_d, phi_d] = [theta_h, theta_d, phi_d].map(f64::from);
    HalfDifference::from_angles(Angles {
        theta_h,
        theta_d,
        phi_d,
    })
}

/// The virtual readings and the present ones.
fn weighted_readings(contents: &CompletedContents, readings: &Readings) -> Vec<WeightedReading> {
    let steps = contents.gauss_newton.as_ref().unwrap();
    let coefficients = fitted_coefficients(contents, &contents.recipe(), readings);
    let directions = steps.directions.as_chunks().0;
    let mut weighted = Vec::new();
    for (index, (angles, center)) in directions.iter().zip(&steps.center).enumerate() {
        let at = half_difference(*angles);
        let row = scaled(&steps.rows, &steps.row_scales, index);
        let w = at.cos_theta_i() * at.cos_theta_o();
        weighted.push(WeightedReading {
            at,
            measured: [0, 1, 2].map(|channel| brdf_of(&row, *center, &coefficients[channel], w)),
            weight: 1.0 / directions.len() as f64,
        });
    }
    let present = readings.iter().flatten().count() as f64;
    for (angles, reading) in contents.pattern.as_chunks().0.iter().zip(readings) {
        if let Some(brdf) = reading {
            weighted.push(WeightedReading {
                at: half_difference(*angles),
                measured: brdf.map(f64::from),
                weight: f64::from(steps.reading_weight) / present,
            });
        }
    }
    weighted
}

/// The BRDF of the parameters. Neural's may be negative.
fn modeled<M: Model>(parameters: &[f64], at: &HalfDifference<f64>) -> [f64; 3] {
    M::unclamped_brdf::<f64>(M::Parameters::view(parameters).unwrap(), at)
}

/// The derivatives of a channel with respect to some parameters, as central differences with an error below 1e-8.
fn derivatives<M: Model>(
    parameters: &[f64],
    at: &HalfDifference<f64>,
    channel: usize,
    active: &[usize],
) -> Vec<f64> {
    const STEP: f64 = 1e-4;
    let mut moved = parameters.to_vec();
    let derivatives = active.iter().map(|index| {
        moved[*index] = parameters[*index] + STEP;
        let above = modeled::<M>(&moved, at)[channel];
        moved[*index] = parameters[*index] - STEP;
        let below = modeled::<M>(&moved, at)[channel];
        moved[*index] = parameters[*index];
        (above - below) / (2.0 * STEP)
    });
    derivatives.collect()
}

/// The active parameters of each system, with its channels.
fn systems(model: ModelKind) -> Vec<(Vec<usize>, Vec<usize>)> {
    match model {
        ModelKind::Phong => vec![((0..7).collect(), vec![0, 1, 2])],
        ModelKind::CookTorrance => vec![((0..8).collect(), vec![0, 1, 2])],
        _ => (0..3)
            .map(|c| ((0..22).map(|k| 609 + 3 * k + c).collect(), vec![c]))
            .collect(),
    }
}

/// The parameters after all steps.
fn expected_parameters<M: Model>(contents: &CompletedContents, readings: &Readings) -> Vec<f64> {
    let steps = contents.gauss_newton.as_ref().unwrap();
    let error_scale = f64::from(steps.error_scale);
    let weighted = weighted_readings(contents, readings);
    let initial = expected_values(contents, &contents.recipe(), readings);
    let mut parameters = initial.clone();
    for _ in 0..steps.steps {
        let before = parameters.clone();
        for (active, channels) in systems(M::KIND) {
            let mut matrix = diagonal(&steps.precision);
            let distances = active.iter().map(|index| initial[*index] - before[*index]);
            let pairs = steps.precision.iter().zip(distances);
            let mut right: Vec<f64> = pairs.map(|(p, d)| f64::from(*p) * d).collect();
            for reading in &weighted {
                let c = reading.at.cos_theta_i();
                let f = modeled::<M>(&before, &reading.at);
                for channel in &channels {
                    let f = f[*channel];
                    let residual = (1.0 + reading.measured[*channel] * c).ln() - (1.0 + f * c).ln();
                    let weight = reading.weight * error_scale / (error_scale + residual.abs());
                    let row = derivatives::<M>(&before, &reading.at, *channel, &active);
                    let row: Vec<f64> = row.iter().map(|d| c / (1.0 + f * c) * d).collect();
                    add_row(&mut matrix, &mut right, &row, weight, residual);
                }
            }
            for (index, delta) in active.iter().zip(solve(matrix, right)) {
                parameters[*index] += delta;
            }
        }
    }
    parameters
}

/// The models that Gauss-Newton steps fit.
const STEPPED: [ModelKind; 3] = [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural];

/// Contents with Gauss-Newton steps, without and with a correction.
fn contents(model: ModelKind) -> [CompletedContents; 2] {
    let plain = CompletedContents::small(model, MissingPolicy::Scaled);
    let corrected = plain.clone().corrected(CORRECTED);
    [plain, corrected].map(CompletedContents::stepped)
}

fn steps_mut(contents: &mut CompletedContents) -> &mut GaussNewtonPart {
    contents.gauss_newton.as_mut().unwrap()
}

fn check_fit<M: Model + ScanModel>() {
    for contents in contents(M::KIND) {
        for readings in cases() {
            let values = full_scan::<M>(&contents, &readings).values();
            let expected = expected_parameters::<M>(&contents, &readings);
            let start = expected_values(&contents, &contents.recipe(), &readings);
            let moves = start.iter().zip(&expected).map(|(a, b)| (a - b).abs());
            assert!(moves.fold(0.0, f64::max) > 20.0 * SYSTEM_TOLERANCE);
            let values = values.into_iter();
            assert_within(SYSTEM_TOLERANCE, M::KIND.name(), values, &expected);
        }
    }
}

#[test]
fn fit_matches_formulas() {
    check_fit::<Phong>();
    check_fit::<CookTorrance>();
    check_fit::<Neural>();
}

/// Coefficients of 1, which the net has without readings and without hidden units.
fn with_coefficients_of_1(mut contents: CompletedContents) -> CompletedContents {
    contents.readings.fill(0);
    contents.output.fill(0);
    contents.bias.fill(1.0);
    if let Some(correction_part) = &mut contents.correction {
        correction_part.rows.fill(0);
    }
    contents
}

/// A virtual reading that is NaN does not count as 0. All coefficients are finite.
#[test]
fn nan_virtual_reading_diverges() {
    let readings = all_readings(SAMPLES);
    for model in STEPPED {
        for contents in contents(model).map(with_coefficients_of_1) {
            for weight in [0, 127] {
                let mut contents = contents.clone();
                let steps = steps_mut(&mut contents);
                let components = steps.row_scales.len();
                steps.row_scales.fill(f32::MAX);
                // The sum of both products is infinity minus infinity, or 0.
                for row in steps.rows.chunks_exact_mut(components) {
                    row.fill(0);
                    [row[0], row[1]] = [weight, -weight];
                }
                let outcome = full_scan::<Any>(&contents, &readings);
                assert_eq!(outcome == Outcome::Diverged, weight != 0, "{model}");
            }
        }
    }
}

proptest! {
    /// Random valid recipes give finite values, or a reported divergence.
    #[test]
    fn steps_of_any_numbers_fit_or_diverge(
        model in 0..STEPPED.len(),
        rows in prop::collection::vec(any::<i8>(), VIRTUAL_READINGS * 4),
        scales in prop::collection::vec(-38.0..38.0_f32, 4),
        precisions in prop::collection::vec(-5.99..7.99_f32, 22),
        [initial, reading_weight, error_scale] in [-38.0..38.0_f32, -38.0..4.0, -38.0..4.0],
    ) {
        let [mut contents, _] = contents(STEPPED[model]);
        let power = |exponent: &f32| 10.0_f32.powf(*exponent);
        let steps = steps_mut(&mut contents);
        steps.rows = rows;
        steps.row_scales = scales.iter().map(power).collect();
        for (precision, exponent) in steps.precision.iter_mut().zip(&precisions) {
            *precision = power(exponent);
        }
        for value in &mut steps.initial {
            *value *= power(&initial);
        }
        steps.reading_weight = power(&reading_weight).min(MAX_READING_WEIGHT);
        steps.error_scale = power(&error_scale).min(MAX_READING_WEIGHT);
        let outcome = full_scan::<Any>(&contents, &all_readings(SAMPLES));
        let is_valid = matches!(outcome, Outcome::Fitted(..) | Outcome::Diverged);
        prop_assert!(is_valid, "{:?}", outcome);
    }
}
