//! Central differences of the unrolled loss.

use std::cell::RefCell;

use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, Phong};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};

use crate::problem::{
    COOK_TORRANCE_STEPS, NEURAL_STEPS, PHONG_STEPS, Problem, gradient_by_variables, problems,
};
use glimpse_gradcheck::cases::{NAMES, cook_torrance, is_too_steep, neural, phong};
use glimpse_gradcheck::{Differences, scale_of};

/// What has been compared so far.
struct Compared {
    initial: Differences,
    step_sizes: Differences,
    samples: Differences,
}

impl Compared {
    /// Compares the meta-gradient of `problem` by the parameters at `indices`, their step sizes,
    /// and all variables of the inner samples.
    fn compare<M: Model>(&mut self, problem: &Problem, indices: &[usize]) -> Result<(), String> {
        let found = problem.meta_gradient::<M>();
        let loss = problem.loss::<M>().0;
        if (found.loss - loss).abs() > 1e-14 {
            return Err(format!("the loss is {} and not {loss}", found.loss));
        }

        let initial_scale = scale_of(&found.initial);
        let step_size_scale = scale_of(&found.step_sizes);
        for index in indices.iter().copied() {
            let what = format!("initial parameter {index}");
            let slope = found.initial[index];
            self.initial
                .compare(&what, slope, initial_scale, |offset| {
                    let mut problem = problem.clone();
                    problem.initial[index] += offset;
                    problem.loss::<M>()
                })?;
            let what = format!("step size {index}");
            let slope = found.step_sizes[index];
            self.step_sizes
                .compare(&what, slope, step_size_scale, |offset| {
                    let mut problem = problem.clone();
                    problem.step_sizes[index] += offset;
                    problem.loss::<M>()
                })?;
        }

        let by_samples = gradient_by_variables(&found);
        let scale = scale_of(by_samples.as_flattened());
        for (index, slopes) in by_samples.iter().enumerate() {
            if is_too_steep(M::KIND, problem.inner[index]) {
                self.samples.discard(NAMES.len());
                continue;
            }
            for (variable, (slope, name)) in slopes.iter().zip(NAMES).enumerate() {
                let what = format!("{name} of inner sample {index}");
                self.samples.compare(&what, *slope, scale, |offset| {
                    let mut problem = problem.clone();
                    problem.inner[index][variable] += offset;
                    problem.loss::<M>()
                })?;
            }
        }
        Ok(())
    }
}

/// Compares `cases` random problems, each by `count` parameters.
fn compare_many<M: Model>(
    cases: usize,
    count: usize,
    step: f64,
    problems: impl Strategy<Value = Problem>,
) {
    let compared = RefCell::new(Compared {
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
    let indices = prop::collection::vec(0..M::PARAMETERS, count);
    let outcome = TestRunner::new(config).run(&(problems, indices), |(problem, indices)| {
        let mut compared = compared.borrow_mut();
        compared
            .compare::<M>(&problem, &indices)
            .map_err(TestCaseError::fail)
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
    let name = M::KIND.name();
    let Compared {
        initial,
        step_sizes,
        samples,
    } = compared.into_inner();
    initial.conclude(&format!("{name} by initial parameters"), cases * count / 4);
    step_sizes.conclude(&format!("{name} by step sizes"), cases * count / 4);
    // Of eight variables the three measured values have no slope; see `problem::gradient_by_variables`.
    // Nor has Cook-Torrance by dy, which it does not read.
    let least = match M::KIND {
        ModelKind::CookTorrance => 3,
        _ => 4,
    };
    samples.conclude(
        &format!("{name} by inner samples"),
        cases * SAMPLES[0] * least,
    );
}

/// Inner and outer samples.
const SAMPLES: [usize; 2] = [5, 7];

#[test]
fn phong_agrees_with_differences() {
    let problems = problems::<Phong>(phong(), PHONG_STEPS, 8, SAMPLES);
    compare_many::<Phong>(200, 14, 5e-5, problems);
}

#[test]
fn cook_torrance_agrees_with_differences() {
    let problems = problems::<CookTorrance>(cook_torrance(), COOK_TORRANCE_STEPS, 8, SAMPLES);
    compare_many::<CookTorrance>(200, 16, 1e-4, problems);
}

#[test]
fn neural_agrees_with_differences() {
    let problems = problems::<Neural>(neural(), NEURAL_STEPS, 5, SAMPLES);
    compare_many::<Neural>(40, 60, 1e-4, problems);
}
