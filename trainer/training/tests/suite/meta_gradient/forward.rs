//! The adjoints of both fits against derivatives in forward mode.

use std::cell::Cell;
use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong, Sample, SampleGradient};
use glimpse_core::numeric::{Real, Scalar};
use glimpse_gradcheck::cases::{Variables, cook_torrance, neural, phong, sample, variables};
use glimpse_gradcheck::{Forward, compare};
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewtonSteps, ReadingAdjoint};
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient, SampleList};
use glimpse_materials::sampling::uniform_valid;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// An inner loop with inner and outer samples.
#[derive(Clone, Debug)]
struct Problem {
    initial: Vec<f64>,
    step_sizes: Vec<f64>,
    steps: usize,
    inner: Vec<Variables>,
    outer: Vec<Variables>,
}

/// Returns a strategy for problems with random initial parameters, step sizes and samples. Step sizes have a range for
/// each model: smaller steps have no effect, and larger ones diverge.
fn problems<M: Model>(
    initial: impl Strategy<Value = Vec<f64>>,
    log_step_sizes: Range<f64>,
    steps: usize,
) -> impl Strategy<Value = Problem> {
    let step_sizes = prop::collection::vec(log_step_sizes.prop_map(f64::exp), M::PARAMETERS);
    let [inner, outer] = [5, 7].map(|count| prop::collection::vec(variables(), count));
    (initial, step_sizes, inner, outer).prop_map(move |(initial, step_sizes, inner, outer)| {
        Problem {
            initial,
            step_sizes,
            steps,
            inner,
            outer,
        }
    })
}

/// Converts variables to samples of equal weight, for the mean over samples and channels.
fn samples<S: Scalar>(list: &[[S; 8]]) -> Vec<Sample<S>> {
    let weight = 1.0 / (3.0 * list.len() as f64);
    list.iter().map(|list| sample(*list, weight)).collect()
}

impl Problem {
    /// Returns theta_0, alpha, and the variables of the inner samples in one list.
    fn inputs(&self) -> Vec<f64> {
        let inner = self.inner.as_flattened();
        [&self.initial[..], &self.step_sizes, inner].concat()
    }

    /// Returns the outer loss of inputs, computed forward.
    fn loss<M: Model, S: Real>(&self, inputs: &[S]) -> S {
        let (initial, rest) = inputs.split_at(M::PARAMETERS);
        let (step_sizes, inner) = rest.split_at(M::PARAMETERS);
        let inner_loop = InnerLoop {
            initial,
            step_sizes,
            steps: self.steps,
        };
        let fitted = inner_loop.fit::<M>(&samples(inner.as_chunks().0)[..]);
        let outer = self.outer.iter().map(|list| list.map(S::constant));
        let outer = samples(&outer.collect::<Vec<_>>());
        SampleList::<M, S>::gradient(&outer[..], &fitted, &mut initial.to_vec())
    }

    /// Returns the meta-gradient under test, and the gradient with respect to the variables of the inner samples.
    ///
    /// The entries of measured values are 0. The inner loss is an absolute difference of logarithms, so its gradient with
    /// respect to the parameters depends on a measured value only by the sign of the difference.
    fn meta_gradient<M: Model>(&self) -> (MetaGradient<f64>, Vec<f64>) {
        let inner_loop = InnerLoop {
            initial: &self.initial,
            step_sizes: &self.step_sizes,
            steps: self.steps,
        };
        let (inner, outer) = (samples(&self.inner), samples(&self.outer));
        let mut by_samples = vec![SampleGradient::zero(); inner.len()];
        let gradient =
            inner_loop.meta_gradient::<M, _, _>(&[&inner[..]], &outer[..], Some(&mut by_samples));
        (gradient, by_samples.iter().flat_map(flat).collect())
    }
}

/// Returns a gradient with respect to a sample as a list: half vector, difference vector and measured values.
pub(crate) fn flat<T: Copy>(gradient: &SampleGradient<T>) -> [T; 8] {
    let [hx, hz, dx, dy, dz] = gradient.at.to_array();
    let [red, green, blue] = gradient.measured;
    [hx, hz, dx, dy, dz, red, green, blue]
}

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
        let (gradient, by_samples) = problem.meta_gradient::<M>();
        let inputs = problem.inputs();
        let loss = problem.loss::<M, f64>(&inputs);
        prop_assert!((gradient.loss - loss).abs() <= 1e-14);
        let lengths = [M::PARAMETERS, M::PARAMETERS, by_samples.len()];
        nonzero.set(nonzero.get() + usize::from(by_samples[0] != 0.0));
        let list = [gradient.initial, gradient.step_sizes, by_samples].concat();
        let loss = |inputs: &[Forward]| problem.loss::<M, Forward>(inputs);
        compare(&lengths, &inputs, &list, loss).map_err(TestCaseError::fail)
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    assert!(nonzero.get() > cases as usize / 2, "{}", nonzero.get());
}

#[test]
fn meta_gradient_matches_forward_mode() {
    assert_meta_gradient::<Phong>(200, problems::<Phong>(phong(), -4.0..0.0, 8));
    // Highlights have a higher curvature at small alpha.
    let problem = problems::<CookTorrance>(cook_torrance(), -5.0..-2.0, 8);
    assert_meta_gradient::<CookTorrance>(200, problem);
    assert_meta_gradient::<Neural>(40, problems::<Neural>(neural(), -6.0..-3.0, 5));
}

const READINGS: usize = 12;
const STEPS: usize = 2;

/// Gauss-Newton steps, given theta_0, precisions, the error scale, and nine numbers for each reading.
struct Steps<R> {
    initial: Vec<R>,
    precision: Vec<R>,
    error_scale: R,
    readings: Vec<Sample<R>>,
}

impl<R: Real> Steps<R> {
    fn new<M: Model>(inputs: &[R]) -> Self {
        let (initial, rest) = inputs.split_at(M::PARAMETERS);
        let (precision, rest) = rest.split_at(M::ACTIVE.count());
        let (error_scale, readings) = rest.split_at(1);
        let sample = |numbers: &[R; 9]| {
            let [hx, hz, dx, dy, dz, red, green, blue, weight] = *numbers;
            Sample {
                at: HalfDifference::from_array([hx, hz, dx, dy, dz]),
                measured: [red, green, blue],
                weight,
            }
        };
        Self {
            initial: initial.to_vec(),
            precision: precision.to_vec(),
            error_scale: error_scale[0],
            readings: readings.as_chunks().0.iter().map(sample).collect(),
        }
    }

    fn fit(&self) -> GaussNewtonSteps<'_, R> {
        GaussNewtonSteps {
            initial: &self.initial,
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
        let at = HalfDifference::from_angles(angles);
        inputs.extend(at.to_array().map(f64::from));
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
        let problem = Steps::new::<M>(&inputs);
        let (_, steps) = problem.fit().fit::<M>(&problem.readings[..]);
        let mut gradient = FitGradient {
            initial: by_fitted.clone(),
            precision: vec![0.0; problem.precision.len()],
            error_scale: 0.0,
        };
        let none = ReadingAdjoint {
            sample: SampleGradient::zero(),
            weight: 0.0,
        };
        let mut by_readings = vec![none; READINGS];
        problem.fit().adjoint::<M, _>(
            &steps,
            &problem.readings[..],
            &mut gradient,
            &mut by_readings,
        );
        let mut list = gradient.initial;
        list.extend(gradient.precision);
        list.push(gradient.error_scale);
        for ReadingAdjoint { sample, weight } in by_readings {
            list.extend(flat(&sample));
            list.push(weight);
        }
        assert!(list.iter().any(|entry| entry.abs() > 0.1));
        let groups = [M::PARAMETERS, M::ACTIVE.count(), 1, 9 * READINGS];
        let outcome = compare(&groups, &inputs, &list, |inputs| {
            let problem = Steps::new::<M>(inputs);
            let (fitted, _) = problem.fit().fit::<M>(&problem.readings[..]);
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
