//! Comparison of the meta-gradient with central differences of the unrolled loss.

use std::cell::RefCell;

use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, Phong};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};

use crate::problem::{
    COOK_TORRANCE_LOG_STEP_SIZES, NEURAL_LOG_STEP_SIZES, PHONG_LOG_STEP_SIZES, Problem,
    gradient_by_variables, problems,
};
use glimpse_gradcheck::cases::{VARIABLE_NAMES, cook_torrance, is_too_steep, neural, phong};
use glimpse_gradcheck::{Differences, gradient_scale};

/// Comparisons of the meta-gradients of all problems with central differences.
struct Comparisons {
    initial: Differences,
    step_sizes: Differences,
    samples: Differences,
}

impl Comparisons {
    /// Compares the meta-gradient of `problem` with central differences along the parameters at `indices`, their step
    /// sizes, and all variables of the inner samples.
    fn compare<M: Model>(&mut self, problem: &Problem, indices: &[usize]) -> Result<(), String> {
        let gradient = problem.meta_gradient::<M>();
        let loss = problem.loss::<M>().0;
        if (gradient.loss - loss).abs() > 1e-14 {
            return Err(format!("the loss is {} instead of {loss}", gradient.loss));
        }

        let initial_scale = gradient_scale(&gradient.initial);
        let step_size_scale = gradient_scale(&gradient.step_sizes);
        for index in indices.iter().copied() {
            let name = format!("initial parameter {index}");
            let slope = gradient.initial[index];
            self.initial
                .compare(&name, slope, initial_scale, |offset| {
                    let mut problem = problem.clone();
                    problem.initial[index] += offset;
                    problem.loss::<M>()
                })?;
            let name = format!("step size {index}");
            let slope = gradient.step_sizes[index];
            self.step_sizes
                .compare(&name, slope, step_size_scale, |offset| {
                    let mut problem = problem.clone();
                    problem.step_sizes[index] += offset;
                    problem.loss::<M>()
                })?;
        }

        let by_samples = gradient_by_variables(&gradient);
        let scale = gradient_scale(by_samples.as_flattened());
        for (index, slopes) in by_samples.iter().enumerate() {
            if is_too_steep(M::KIND, problem.inner[index]) {
                self.samples.discard(VARIABLE_NAMES.len());
                continue;
            }
            for (variable, (slope, variable_name)) in slopes.iter().zip(VARIABLE_NAMES).enumerate()
            {
                let name = format!("{variable_name} of inner sample {index}");
                self.samples.compare(&name, *slope, scale, |offset| {
                    let mut problem = problem.clone();
                    problem.inner[index][variable] += offset;
                    problem.loss::<M>()
                })?;
            }
        }
        Ok(())
    }
}

/// Compares the meta-gradients of `cases` random problems with central differences of width `step`, along
/// `parameters_per_case` random parameters of each.
fn compare_many<M: Model>(
    cases: usize,
    parameters_per_case: usize,
    step: f64,
    problems: impl Strategy<Value = Problem>,
) {
    let comparisons = RefCell::new(Comparisons {
        initial: Differences::new(step, 1e-5),
        step_sizes: Differences::new(step, 1e-5),
        samples: Differences::new(step, 1e-5),
    });
    let config = ProptestConfig {
        cases: cases as u32,
        max_shrink_iters: 50,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let indices = prop::collection::vec(0..M::PARAMETERS, parameters_per_case);
    let result = TestRunner::new(config).run(&(problems, indices), |(problem, indices)| {
        let mut comparisons = comparisons.borrow_mut();
        comparisons
            .compare::<M>(&problem, &indices)
            .map_err(TestCaseError::fail)
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    let model = M::KIND.name();
    let Comparisons {
        initial,
        step_sizes,
        samples,
    } = comparisons.into_inner();
    // Slopes may be 0, and unreliable differences are discarded.
    let min_nonzero = cases * parameters_per_case / 4;
    initial.assert_enough_compared(&format!("{model} by initial parameters"), min_nonzero);
    step_sizes.assert_enough_compared(&format!("{model} by step sizes"), min_nonzero);
    // Three of the eight variables of a sample are measured values, whose derivatives are 0; see
    // `problem::gradient_by_variables`. Cook-Torrance does not depend on dy either.
    let min_nonzero_variables = match M::KIND {
        ModelKind::CookTorrance => 3,
        _ => 4,
    };
    samples.assert_enough_compared(
        &format!("{model} by inner samples"),
        cases * SAMPLES[0] * min_nonzero_variables,
    );
}

/// The numbers of inner and outer samples.
const SAMPLES: [usize; 2] = [5, 7];

#[test]
fn phong_matches_finite_differences() {
    let problems = problems::<Phong>(phong(), PHONG_LOG_STEP_SIZES, 8, SAMPLES);
    compare_many::<Phong>(200, 14, 5e-5, problems);
}

#[test]
fn cook_torrance_matches_finite_differences() {
    let problems =
        problems::<CookTorrance>(cook_torrance(), COOK_TORRANCE_LOG_STEP_SIZES, 8, SAMPLES);
    compare_many::<CookTorrance>(200, 16, 1e-4, problems);
}

#[test]
fn neural_matches_finite_differences() {
    let problems = problems::<Neural>(neural(), NEURAL_LOG_STEP_SIZES, 5, SAMPLES);
    compare_many::<Neural>(40, 60, 1e-4, problems);
}
