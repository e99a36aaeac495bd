//! The models' gradients compared with derivatives in forward mode, and their losses compared with the formulas.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{
    CookTorrance, CookTorranceParameters, Model, Neural, NeuralParameters, ParameterSet, Phong,
    SampleGradient,
};
use glimpse_core::numeric::Scalar;
use proptest::prelude::*;

use crate::reference::{self, logistic};
use glimpse_gradcheck::cases::{Variables, cook_torrance, neural, phong, sample, variables};
use glimpse_gradcheck::{compare, parameters};

/// The weighted loss.
fn loss<M: Model, S: Scalar<Parameter = S, Sum = S>>(
    list: &[S],
    variables: [S; 8],
    weight: f64,
) -> S {
    let zero = S::constant(0.0);
    let theta = parameters(list.iter().copied(), zero);
    let mut gradient = parameters([], zero);
    M::accumulate_gradient::<S, false>(&theta, &sample(variables, weight), &mut gradient).loss()
}

/// Compares the derivatives of one model at one sample: those with respect to parameters, directions and readings.
fn gradient_matches<M: Model>(
    list: &[f64],
    variables: Variables,
    weight: f64,
) -> Result<(), TestCaseError> {
    let theta = parameters(list.iter().copied(), 0.0);
    let mut gradient: M::Parameters<f64> = parameters([], 0.0);
    let sample = sample(variables, weight);
    let actual = M::accumulate_gradient::<f64, true>(&theta, &sample, &mut gradient).gradient;
    let mut derivatives = gradient.as_ref().to_vec();
    derivatives.extend(actual.at.to_array());
    derivatives.extend(actual.measured);
    let point = [list, &variables].concat();
    let outcome = compare(&[M::PARAMETERS, 5, 3], &point, &derivatives, |point| {
        let (list, variables) = point.split_at(M::PARAMETERS);
        loss::<M, _>(list, variables.try_into().unwrap(), weight)
    });
    outcome.map_err(TestCaseError::fail)
}

/// weight * sum of |ln(1 + y c) - ln(1 + f c)|, in plain f64.
fn expected_loss(variables: Variables, modeled: [f64; 3], weight: f64) -> f64 {
    let [hx, hz, dx, _, dz, y @ ..] = variables;
    let cosine = (hz * dz - hx * dx).clamp(0.0, 1.0);
    let errors = y
        .iter()
        .zip(modeled)
        .map(|(y, f)| ((1.0 + y * cosine).ln() - (1.0 + f * cosine).ln()).abs());
    weight * errors.sum::<f64>()
}

fn agree(actual: f64, expected: f64) -> Result<(), TestCaseError> {
    let error = (actual - expected).abs();
    prop_assert!(
        error <= 1e-12 * expected.abs().max(1e-2),
        "{actual} instead of {expected}"
    );
    Ok(())
}

/// Checks a model's BRDF and loss against the BRDF of its formula.
fn agree_with<M: Model>(
    list: &[f64],
    variables: Variables,
    weight: f64,
    expected: [f64; 3],
) -> Result<(), TestCaseError> {
    let theta = parameters(list.iter().copied(), 0.0);
    let actual = M::brdf::<f64>(&theta, &sample(variables, weight).at);
    for (actual, expected) in actual.into_iter().zip(expected) {
        agree(actual, expected)?;
    }
    let loss = loss::<M, f64>(list, variables, weight);
    agree(loss, expected_loss(variables, expected, weight))
}

/// Samples at the highlight's center, and at grazing and nearly opposite directions. Rounding puts some slightly
/// below the horizon. There, single precision overflows sooner than elsewhere.
fn extremes() -> impl Strategy<Value = Variables> {
    // Distances of angles from 0 or pi/2, over eight decades.
    let angle = || {
        (any::<bool>(), -8.0..0.0f64).prop_map(|(low, logarithm)| {
            let distance = FRAC_PI_2 * 10.0_f64.powf(logarithm);
            if low { distance } else { FRAC_PI_2 - distance }
        })
    };
    let phi_d = prop_oneof![Just(0.0), Just(FRAC_PI_2), Just(PI), 0.0..TAU];
    let logarithms = prop::array::uniform3(-12.0..12.0f64);
    (angle(), angle(), phi_d, logarithms).prop_map(|(theta_h, theta_d, phi_d, logarithms)| {
        let at = HalfDifference::from_angles(Angles::from_array([theta_h, theta_d, phi_d]));
        let [red, green, blue] = logarithms.map(f64::exp);
        let [hx, hz, dx, dy, dz] = at.to_array();
        [hx, hz, dx, dy, dz, red, green, blue]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn gradients_match_forward_mode(
        (phong, cook_torrance, neural) in (phong(), cook_torrance(), neural()),
        variables in variables(),
        weight in 0.01..1.0f64,
    ) {
        gradient_matches::<Phong>(&phong, variables, weight)?;
        gradient_matches::<CookTorrance>(&cook_torrance, variables, weight)?;
        gradient_matches::<Neural>(&neural, variables, weight)?;
    }

    #[test]
    fn models_match_formulas(
        (phong, cook_torrance, neural) in (phong(), cook_torrance(), neural()),
        variables in variables(),
        weight in 0.01..1.0f64,
    ) {
        let at = sample(variables, weight).at.to_array();
        agree_with::<Phong>(&phong, variables, weight, reference::phong(&phong, at))?;
        agree_with::<CookTorrance>(&cook_torrance, variables, weight, reference::cook_torrance(&cook_torrance, at))?;
        agree_with::<Neural>(&neural, variables, weight, reference::neural(&neural, at).map(|f| f.max(0.0)))?;
    }

    #[test]
    fn cook_torrance_stays_finite(
        list in prop::collection::vec(-12.0..12.0f64, CookTorrance::PARAMETERS),
        variables in extremes(),
    ) {
        let theta = parameters(list.iter().map(|logit| *logit as f32), 0.0);
        let mut gradient = CookTorranceParameters::filled(0.0);
        let sample = sample(variables.map(|number| number as f32), 1.0);
        let actual = CookTorrance::accumulate_gradient::<f32, true>(&theta, &sample, &mut gradient);
        prop_assert!(actual.loss().is_finite());
        prop_assert!(gradient.iter().all(|derivative| derivative.is_finite()), "{:?}", gradient);
        let SampleGradient { at, measured } = actual.gradient;
        let derivatives = at.to_array();
        prop_assert!(derivatives.iter().chain(&measured).all(|derivative| derivative.is_finite()), "{:?}", derivatives);
    }

    #[test]
    fn cook_torrance_is_diffuse_below_horizon(list in cook_torrance(), variables in variables(), outgoing in any::<bool>()) {
        // Pushed along x until one of the cosines is negative.
        let [hx, hz, dx, dy, dz, red, green, blue] = variables;
        let push = (hz * dz / hx.max(0.05) + 0.1 + dx.abs()) * if outgoing { -1.0 } else { 1.0 };
        let sample = sample([hx, hz, dx + push, dy, dz, red, green, blue], 1.0);
        let cosine = if outgoing { sample.at.cos_theta_o() } else { sample.at.cos_theta_i() };
        prop_assume!(cosine < 0.0);
        let theta = parameters(list.iter().copied(), 0.0);
        for (f, logit) in CookTorrance::brdf::<f64>(&theta, &sample.at).into_iter().zip(&list) {
            agree(f, logistic(*logit) / PI)?;
        }
    }

    #[test]
    fn light_below_horizon_has_no_loss(list in neural(), variables in variables()) {
        // Pushed along x until hz dz - hx dx, the cosine, is negative.
        let [hx, hz, dx, dy, dz, red, green, blue] = variables;
        let lower = [hx, hz, dx + hz * dz / hx.max(0.05) + 0.1, dy, dz, red, green, blue];
        let sample = sample(lower, 1.0);
        prop_assume!(sample.at.cos_theta_i() < 0.0);
        let theta = parameters(list.iter().copied(), 0.0);
        let mut gradient = NeuralParameters::filled(0.0);
        let actual = Neural::accumulate_gradient::<f64, true>(&theta, &sample, &mut gradient);
        prop_assert_eq!(actual.loss(), 0.0);
        prop_assert!(gradient.iter().all(|derivative| *derivative == 0.0));
        let SampleGradient { at, measured } = actual.gradient;
        prop_assert_eq!(at.to_array(), [0.0; 5]);
        prop_assert_eq!(measured, [0.0; 3]);
    }
}
