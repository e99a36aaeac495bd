//! The adjoints of both fits against derivatives in forward mode.

use std::cell::Cell;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{
    CookTorrance, Model, Neural, ParameterSet, Phong, Sample, SampleGradient,
};
use glimpse_gradcheck::cases::{cook_torrance, neural, phong};
use glimpse_gradcheck::{Forward, compare, parameters};
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewton, ReadingAdjoint};
use glimpse_kernels::inner_loop::Real;
use glimpse_materials::sampling::uniform_valid;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::problem::{
    COOK_TORRANCE_LOG_STEP_SIZES, NEURAL_LOG_STEP_SIZES, PHONG_LOG_STEP_SIZES, Problem,
    gradient_by_variables, problems,
};

/// Compares the meta-gradients of random problems: by initial parameters, step sizes and inner samples.
fn assert_meta_gradient<M: Model>(cases: u32, problems: impl Strategy<Value = Problem>) {
    let config = ProptestConfig {
        cases,
        max_shrink_iters: 50,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let nonzero = Cell::new(0);
    let result = TestRunner::new(config).run(&problems, |problem| {
        let gradient = problem.meta_gradient::<M>();
        let inputs = problem.inputs();
        let loss = problem.loss::<M, f64>(&inputs);
        prop_assert!((gradient.loss - loss).abs() <= 1e-14);
        let by_samples = gradient_by_variables(&gradient);
        let lengths = [M::PARAMETERS, M::PARAMETERS, 8 * by_samples.len()];
        let list = [
            &gradient.initial[..],
            &gradient.step_sizes,
            by_samples.as_flattened(),
        ];
        nonzero.set(nonzero.get() + usize::from(by_samples.as_flattened()[0] != 0.0));
        compare(&lengths, &inputs, &list.concat(), |inputs| {
            problem.loss::<M, Forward>(inputs)
        })
        .map_err(TestCaseError::fail)
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    assert!(nonzero.get() > cases as usize / 2, "{}", nonzero.get());
}

#[test]
fn meta_gradient_matches_forward_mode() {
    let samples = [5, 7];
    let phong = problems::<Phong>(phong(), PHONG_LOG_STEP_SIZES, 8, samples);
    assert_meta_gradient::<Phong>(200, phong);
    let cook_torrance =
        problems::<CookTorrance>(cook_torrance(), COOK_TORRANCE_LOG_STEP_SIZES, 8, samples);
    assert_meta_gradient::<CookTorrance>(200, cook_torrance);
    let neural = problems::<Neural>(neural(), NEURAL_LOG_STEP_SIZES, 5, samples);
    assert_meta_gradient::<Neural>(40, neural);
}

const READINGS: usize = 12;
const STEPS: usize = 2;

/// Gauss-Newton steps, given theta_0, precisions, the error scale, and nine numbers for each reading.
struct Steps<M: Model, R: Real> {
    initial: M::Parameters<R>,
    precision: Vec<R>,
    error_scale: R,
    readings: Vec<Sample<R>>,
}

impl<M: Model, R: Real> Steps<M, R> {
    fn new(inputs: &[R]) -> Self {
        let (initial, rest) = inputs.split_at(M::PARAMETERS);
        let (precision, rest) = rest.split_at(M::ACTIVE.count());
        let (error_scale, readings) = rest.split_at(1);
        let sample = |numbers: &[R; 9]| {
            let [hx, hz, dx, dy, dz, red, green, blue, weight] = *numbers;
            Sample {
                at: HalfDifference { hx, hz, dx, dy, dz },
                measured: [red, green, blue],
                weight,
            }
        };
        Self {
            initial: parameters(initial.iter().copied(), R::constant(0.0)),
            precision: precision.to_vec(),
            error_scale: error_scale[0],
            readings: readings.as_chunks().0.iter().map(sample).collect(),
        }
    }

    fn fit(&self) -> GaussNewton<'_, M, R> {
        GaussNewton {
            initial: self.initial.clone(),
            precision: &self.precision,
            error_scale: self.error_scale,
            steps: STEPS,
        }
    }
}

fn random_inputs<M: Model>(deviation: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let directions = uniform_valid(READINGS, random.random());
    let mut uniform = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let mut inputs: Vec<f64> = (0..M::PARAMETERS)
        .map(|_| uniform(-deviation, deviation))
        .collect();
    inputs.extend((0..M::ACTIVE.count()).map(|_| uniform(0.02, 0.1)));
    inputs.push(uniform(0.05, 0.2));
    for angles in directions {
        let HalfDifference { hx, hz, dx, dy, dz } = HalfDifference::from_angles(angles);
        inputs.extend([hx, hz, dx, dy, dz].map(f64::from));
        inputs.extend([(); 3].map(|()| uniform(0.01, 0.6)));
        inputs.push(uniform(0.5, 1.5) / READINGS as f64);
    }
    inputs
}

/// The loss is the sum of the fitted parameters, weighted with random numbers.
fn assert_steps_adjoint<M: Model>(deviation: f64) {
    for seed in 0..6 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let inputs = random_inputs::<M>(deviation, &mut random);
        let by_fitted: Vec<f64> = (0..M::PARAMETERS)
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        let problem = Steps::<M, f64>::new(&inputs);
        let (_, steps) = problem.fit().fit(&problem.readings[..]);
        let mut gradient = FitGradient {
            initial: parameters(by_fitted.iter().copied(), 0.0),
            precision: vec![0.0; problem.precision.len()],
            error_scale: 0.0,
        };
        let none = ReadingAdjoint {
            sample: SampleGradient::zero(),
            weight: 0.0,
        };
        let mut by_readings = vec![none; READINGS];
        problem.fit().adjoint(
            &steps,
            &problem.readings[..],
            &mut gradient,
            &mut by_readings,
        );
        let mut list = gradient.initial.as_slice().to_vec();
        list.extend(gradient.precision);
        list.push(gradient.error_scale);
        for ReadingAdjoint { sample, weight } in by_readings {
            let HalfDifference { hx, hz, dx, dy, dz } = sample.at;
            list.extend([hx, hz, dx, dy, dz]);
            list.extend(sample.measured);
            list.push(weight);
        }
        assert!(list.iter().any(|entry| entry.abs() > 0.1));
        let groups = [M::PARAMETERS, M::ACTIVE.count(), 1, 9 * READINGS];
        let outcome = compare(&groups, &inputs, &list, |inputs| {
            let problem = Steps::<M, Forward>::new(inputs);
            let (fitted, _) = problem.fit().fit(&problem.readings[..]);
            let products = fitted.iter().zip(&by_fitted);
            products.fold(Forward::fixed(0.0), |sum, (theta, weight)| {
                sum + *theta * Forward::fixed(*weight)
            })
        });
        outcome.unwrap_or_else(|error| panic!("{}, seed {seed}: {error}", M::KIND));
    }
}

#[test]
fn adjoint_of_gauss_newton_steps_matches_forward_mode() {
    assert_steps_adjoint::<Phong>(1.0);
    assert_steps_adjoint::<CookTorrance>(1.0);
    assert_steps_adjoint::<Neural>(0.4);
}
