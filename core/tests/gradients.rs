//! The models' one gradient against central differences, and their loss against the formula.

// f64 is a scalar with libm only.
#![cfg(feature = "libm")]

mod support;

use std::cell::RefCell;
use std::f64::consts::{PI, TAU};

use glimpse_core::model::{
    Model, ModelKind, Neural, NeuralParameters, ParameterSet, Phong, SampleGradient,
};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};

use support::cases::{
    NAMES, Variables, mirror_cosine, near_edge_of_lobe, neural, phong, sample, variables,
};
use support::{Differences, Traced, parameters, scale_of};

/// The weighted loss, every branch recorded.
fn loss<M: Model>(list: &[f64], variables: Variables, weight: f64) -> Traced {
    let zero = Traced(0.0);
    let theta = parameters(list.iter().copied().map(Traced), zero);
    let mut gradient = parameters([], zero);
    M::accumulate_gradient::<Traced, false>(&theta, &sample(variables, weight), &mut gradient).loss
}

/// Compares all derivatives of one model at one sample.
fn compare<M: Model>(
    list: &[f64],
    variables: Variables,
    weight: f64,
    by_parameters: &mut Differences,
    by_sample: &mut Differences,
) -> Result<(), String> {
    let theta = parameters(list.iter().copied(), 0.0);
    let mut gradient: M::Parameters<f64> = parameters([], 0.0);
    let sample = sample(variables, weight);
    let found = M::accumulate_gradient::<f64, true>(&theta, &sample, &mut gradient).gradient;

    let slopes: Vec<f64> = gradient.iter().copied().collect();
    let scale = scale_of(&slopes);
    for (index, slope) in slopes.iter().enumerate() {
        by_parameters.compare(&format!("parameter {index}"), *slope, scale, |offset| {
            let mut list = list.to_vec();
            list[index] += offset;
            loss::<M>(&list, variables, weight)
        })?;
    }

    if M::KIND == ModelKind::Phong && near_edge_of_lobe(variables) {
        by_sample.discard(NAMES.len());
        return Ok(());
    }
    let at = found.at;
    let [red, green, blue] = found.measured;
    let slopes = [at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue];
    let scale = scale_of(&slopes);
    for (index, (slope, name)) in slopes.iter().zip(NAMES).enumerate() {
        by_sample.compare(name, *slope, scale, |offset| {
            let mut variables = variables;
            variables[index] += offset;
            loss::<M>(list, variables, weight)
        })?;
    }
    Ok(())
}

fn compare_many<M: Model>(cases: u32, list: impl Strategy<Value = Vec<f64>>) {
    let by_parameters = RefCell::new(Differences::new(1e-4, 1e-5));
    let by_sample = RefCell::new(Differences::new(1e-4, 1e-5));
    let config = ProptestConfig {
        cases,
        max_shrink_iters: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let outcome = TestRunner::new(config).run(
        &(list, variables(), 0.01..1.0f64),
        |(list, variables, weight)| {
            compare::<M>(
                &list,
                variables,
                weight,
                &mut by_parameters.borrow_mut(),
                &mut by_sample.borrow_mut(),
            )
            .map_err(TestCaseError::fail)
        },
    );
    if let Err(error) = outcome {
        panic!("{error}");
    }
    let name = M::KIND.name();
    let cases = cases as usize;
    by_parameters
        .borrow()
        .conclude(&format!("{name} by parameters"), cases * M::PARAMETERS / 4);
    by_sample
        .borrow()
        .conclude(&format!("{name} by sample"), cases * 8 / 2);
}

#[test]
fn phong_gradient_agrees_with_differences() {
    compare_many::<Phong>(2000, phong());
}

#[test]
fn neural_gradient_agrees_with_differences() {
    compare_many::<Neural>(100, neural());
}

/// weight * sum of |ln(1 + y c) - ln(1 + f c)|, in plain f64.
fn expected_loss(variables: Variables, modelled: [f64; 3], weight: f64) -> f64 {
    let [hx, hz, dx, dy, dz, y @ ..] = variables;
    let _ = dy;
    let cosine = (hz * dz - hx * dx).clamp(0.0, 1.0);
    let errors = y
        .iter()
        .zip(modelled)
        .map(|(y, f)| ((1.0 + y * cosine).ln() - (1.0 + f * cosine).ln()).abs());
    weight * errors.sum::<f64>()
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Phong as the paper writes it.
fn expected_phong(list: &[f64], variables: Variables) -> [f64; 3] {
    let q = list[6].exp();
    let lobe = (q + 2.0) / TAU * (mirror_cosine(variables).max(0.0) + 1e-5).powf(q);
    std::array::from_fn(|channel| {
        let (sum, ratio) = (logistic(list[channel]), logistic(list[3 + channel]));
        let (k_d, k_s) = (sum * ratio, sum * (1.0 - ratio));
        k_d / PI + k_s * lobe
    })
}

/// The network as three matrix products.
fn expected_neural(list: &[f64], variables: Variables) -> [f64; 3] {
    let [hx, hz, dx, dy, dz, ..] = variables;
    let mut values = vec![hx, 0.0, hz, dx, dy, dz];
    let mut rest = list;
    for (layer, outputs) in [21, 21, 3].into_iter().enumerate() {
        let (weights, after) = rest.split_at(values.len() * outputs);
        let (bias, after) = after.split_at(outputs);
        rest = after;
        values = (0..outputs)
            .map(|output| {
                let products = values
                    .iter()
                    .enumerate()
                    .map(|(input, value)| value * weights[input * outputs + output]);
                let sum = bias[output] + products.sum::<f64>();
                if layer < 2 {
                    sum.max(0.0)
                } else {
                    (sum.exp() - 1.0).max(0.0)
                }
            })
            .collect();
    }
    [values[0], values[1], values[2]]
}

fn agree(found: f64, expected: f64) -> Result<(), TestCaseError> {
    let error = (found - expected).abs();
    prop_assert!(
        error <= 1e-12 * expected.abs().max(1e-2),
        "{found} instead of {expected}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn phong_is_its_formula(list in phong(), variables in variables(), weight in 0.01..1.0f64) {
        let expected = expected_phong(&list, variables);
        let theta = parameters(list.iter().copied(), 0.0);
        for (found, expected) in Phong::brdf::<f64>(&theta, &sample(variables, weight).at).into_iter().zip(expected) {
            agree(found, expected)?;
        }
        agree(loss::<Phong>(&list, variables, weight).0, expected_loss(variables, expected, weight))?;
    }

    #[test]
    fn neural_is_its_formula(list in neural(), variables in variables(), weight in 0.01..1.0f64) {
        let expected = expected_neural(&list, variables);
        let theta = parameters(list.iter().copied(), 0.0);
        for (found, expected) in Neural::brdf::<f64>(&theta, &sample(variables, weight).at).into_iter().zip(expected) {
            agree(found, expected)?;
        }
        agree(loss::<Neural>(&list, variables, weight).0, expected_loss(variables, expected, weight))?;
    }

    #[test]
    fn light_from_below_costs_nothing(list in neural(), variables in variables()) {
        // Pushed along x until hz dz - hx dx, the cosine, is negative.
        let [hx, hz, dx, dy, dz, red, green, blue] = variables;
        let lower = [hx, hz, dx + hz * dz / hx.max(0.05) + 0.1, dy, dz, red, green, blue];
        let sample = sample::<f64>(lower, 1.0);
        prop_assume!(sample.at.cos_theta_i() < 0.0);
        let theta = parameters(list.iter().copied(), 0.0);
        let mut gradient = NeuralParameters::filled(0.0);
        let found = Neural::accumulate_gradient::<f64, true>(&theta, &sample, &mut gradient);
        prop_assert_eq!(found.loss, 0.0);
        prop_assert!(gradient.iter().all(|slope| *slope == 0.0));
        let SampleGradient { at, measured } = found.gradient;
        prop_assert_eq!([at.hx, at.hz, at.dx, at.dy, at.dz], [0.0; 5]);
        prop_assert_eq!(measured, [0.0; 3]);
    }
}
