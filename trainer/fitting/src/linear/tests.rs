//! Tests of posteriors, with the bundled recipe `linear-any`.

use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, FittedBrdf, Material, Procedural};

use super::*;

pub(super) fn prior() -> MaterialPrior {
    let recipe = include_bytes!("../../../recipes/any/linear-any.recipe");
    let basis = include_bytes!("../../../recipes/any/linear-any.basis");
    let recipe = Recipe::parse(recipe).expect("a valid recipe");
    let basis = BasisTable::parse(basis).expect("a valid basis");
    MaterialPrior::new(&recipe, Arc::new(basis)).expect("a recipe without a pattern")
}

pub(super) fn readings(material: &dyn Material, count: usize) -> Vec<PosteriorReading> {
    let angles = uniform_valid(count, 5).into_iter();
    angles
        .map(|angles| PosteriorReading::new(angles, material.at_angles(angles)))
        .collect()
}

/// A line in the plane of incidence, with the light at 45 degrees and the sensor at every 5 degrees.
fn line(material: &dyn Material) -> Vec<PosteriorReading> {
    let angles = (-16_i8..=16).filter(|step| *step != -9).map(|step| {
        let [theta_i, theta_o] = [45.0, 5.0 * f32::from(step)];
        let at = glimpse_core::geometry::Arms {
            theta_i,
            phi_i: 0.0,
            theta_o: f32::abs(theta_o),
            phi_o: if theta_o < 0.0 { 0.0 } else { 180.0 },
        };
        let directions = at.map(f32::to_radians).directions();
        let at = HalfDifference::from_directions(&directions).expect("a half vector");
        glimpse_materials::angles_of(&at)
    });
    angles
        .map(|angles| PosteriorReading::new(angles, material.at_angles(angles)))
        .collect()
}

fn posterior(readings: &[PosteriorReading]) -> Posterior {
    Posterior::new(&prior(), readings).expect("finite")
}

fn left_out(posterior: &Posterior, index: usize) -> Option<LeftOut> {
    posterior.left_out(&[&[index]])[0]
        .as_ref()
        .map(|readings| readings[0])
}

fn fit(posterior: &Posterior) -> FittedBrdf {
    let basis = posterior.basis().with_kernels(posterior.kernels());
    let values = posterior.coefficients().concat();
    FittedBrdf::new(ModelKind::Linear, values, Some(&basis)).expect("values of the basis")
}

/// Components and kernels with the posterior's coefficients are its expected material.
#[test]
fn fit_is_the_expected_material() {
    for count in [5, 40] {
        let posterior = posterior(&readings(&Procedural::new(3, 7), count));
        let (fit, others) = (fit(&posterior), uniform_valid(60, 8));
        let at = posterior.prior().at(others.clone());
        for (index, predicted) in posterior.predict(&at).iter().enumerate() {
            let weight = f64::from(at.components.cosines[index].value);
            let center = f64::from(at.components.mean[index].value);
            let fitted = fit.at_angles(others[index]);
            for (fitted, expected) in fitted.iter().zip(predicted.expected) {
                let expected = unmap(center + expected, weight);
                let error = (f64::from(*fitted) - expected).abs();
                assert!(error < 2e-3 * (0.01 + expected), "{fitted} {expected}");
            }
        }
    }
}

/// Predictions equal those of posteriors without the reading, which are those after its removal.
#[test]
fn left_out_readings_are_predicted_by_the_others() {
    let all = readings(&Procedural::new(3, 7), 9);
    let with_all = posterior(&all);
    for index in 0..all.len() {
        let prediction = left_out(&with_all, index).expect("a reading");
        let mut others = all.clone();
        let own = others.remove(index);
        let without = posterior(&others);
        let at = without.prior().at(vec![own.angles]);
        let predicted = without.predict(&at)[0];
        let weight = f64::from(at.components.cosines[0].value);
        let center = f64::from(at.components.mean[0].value);
        for (expected, left_out) in predicted.expected.iter().zip(prediction.expected) {
            let brdf = unmap(center + expected, weight) as f32;
            assert!(
                (brdf - left_out).abs() < 1e-4 * (1.0 + brdf),
                "{brdf} {left_out}"
            );
        }
        // The reading has noise, too.
        let noise = without.scale(0.0, 0) * f64::from(DEFAULT_NOISE * DEFAULT_NOISE);
        let deviation = (predicted.variance + noise).sqrt();
        let z = [0, 1, 2].map(|channel: usize| {
            let u = map(f64::from(own.brdf[channel].max(0.0)), weight) - center;
            (u - predicted.expected[channel]) / deviation
        });
        let largest = z.into_iter().map(f64::abs).fold(0.0, f64::max);
        assert!(prediction.z.abs() > 0.999 * largest, "{prediction:?} {z:?}");

        let removed = with_all.without(&[index]).expect("finite");
        assert!(left_out(&removed, index).is_none() && removed.readings() == 8);
        let [one, other] = [&removed, &without].map(|posterior| posterior.predict(&at)[0]);
        assert!((one.variance / other.variance - 1.0).abs() < 1e-6);
        assert!((one.expected[0] - other.expected[0]).abs() < 1e-6);
    }
}

/// Exact readings are trusted: the deviation there is about that of the noise, and larger elsewhere.
#[test]
fn deviations_at_readings_are_those_of_noise() {
    for index in 0..6 {
        let material = Procedural::new(index, 7);
        let readings = line(&material);
        let posterior = posterior(&readings);
        let fit = fit(&posterior);
        let mean = |directions: Vec<Angles<f32>>| {
            let deviations = posterior.deviations(&fit, directions.clone());
            let relative = deviations.iter().zip(&directions);
            let relative = relative.map(|(deviation, angles)| {
                f64::from(deviation[1] / (fit.at_angles(*angles)[1] + 0.01))
            });
            relative.sum::<f64>() / directions.len() as f64
        };
        let own = mean(readings.iter().map(|reading| reading.angles).collect());
        let elsewhere = mean(uniform_valid(40, 3));
        assert!(own < 1.5 * f64::from(DEFAULT_NOISE), "{index}: {own}");
        assert!(elsewhere > 3.0 * own, "{index}: {own} {elsewhere}");
    }
}

/// A reading that is 50 % too high between neighbors is the one of largest z.
#[test]
fn wrong_reading_of_a_line_is_named() {
    let mut named = 0;
    for index in 0..20 {
        let mut readings = line(&Procedural::new(index, 7));
        readings[12].brdf = readings[12].brdf.map(|f| 1.5 * f);
        let posterior = posterior(&readings);
        let z = |index: usize| left_out(&posterior, index).map_or(0.0, |left_out| left_out.z.abs());
        let largest = (0..readings.len()).max_by(|a, b| z(*a).total_cmp(&z(*b)));
        named += usize::from(largest == Some(12) && z(12) > 4.0);
    }
    assert!(named >= 18, "{named}");
}

/// More readings reduce the uncertainty, wrong ones and distant fits raise it.
#[test]
fn uncertainty_follows_readings() {
    let material = Procedural::new(3, 7);
    let truth = |at: &HalfDifference<f32>| material.at_angles(glimpse_materials::angles_of(at));
    let loss = |readings: &[PosteriorReading]| f64::from(posterior(readings).loss(&truth).loss);
    let (few, many) = (readings(&material, 4), readings(&material, 60));
    assert!(loss(&many) < 0.8 * loss(&few));
    // A wrong reading that is stated to be noise has no influence.
    let mut noisy = many.clone();
    (noisy[0].brdf, noisy[0].noise) = ([99.0; 3], 1e4);
    let ratio = loss(&noisy) / loss(&many[1..]);
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    let mut wrong = many.clone();
    for reading in wrong.iter_mut().step_by(2) {
        reading.brdf = reading.brdf.map(|f| 20.0 * f);
    }
    assert!(loss(&wrong) > 1.5 * loss(&many), "{}", loss(&wrong));
    let black = posterior(&many).loss(&|_: &HalfDifference<f32>| [0.0; 3]);
    assert!(f64::from(black.loss) > 2.0 * loss(&many), "{black:?}");
    assert!(posterior(&[]).loss(&truth).loss.is_finite());
}

/// The density is a t distribution of y' S^-1 y, which the posterior computes without S, and of the slopes of the mapping.
#[test]
fn evidence_agrees_with_the_posterior() {
    let [one, other] = [1, 2].map(|seed| {
        let mut readings = readings(&Procedural::new(3, seed), 12);
        // Unlike any material, so that the posterior's scale states y' S^-1 y.
        readings[0].brdf = [9.0, 0.0, 3.0];
        readings
    });
    let evidence = Evidence::new(&posterior(&one), &one).expect("finite");
    let density = |readings: &[PosteriorReading]| {
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        evidence.log_density(&brdf, &[[0.0; 3]; 12])
    };
    let expected = |readings: &[PosteriorReading]| {
        let square = 3.0 * (18.0 * posterior(readings).scale(0.0, 0) - 6.0);
        let slopes = readings.iter().flat_map(|reading| {
            let at = HalfDifference::from_angles(reading.angles.map(f64::from));
            let weight = at.cos_theta_i() * at.cos_theta_o();
            reading.brdf.map(|f| {
                let [low, high] = [-1e-6, 1e-6].map(|step| map(f64::from(f) + step, weight));
                ((high - low) / 2e-6).ln()
            })
        });
        slopes.sum::<f64>() - 21.0 * (1.0 + square / 6.0).ln()
    };
    let error = density(&one) - density(&other) - (expected(&one) - expected(&other));
    assert!(error.abs() < 1e-3, "{error}");
}
