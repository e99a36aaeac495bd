//! The meta-gradient of the whole unrolled inner loop against central differences of its loss.

#[path = "../../core/tests/support/mod.rs"]
mod support;

use std::cell::RefCell;

use glimpse_core::model::{Model, ModelKind, Neural, Phong, Sample};
use glimpse_core::scalar::Scalar;
use glimpse_trainer::meta::unroll::{Batch, Inner, learn, meta_gradient};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};

use support::cases::{NAMES, Variables, near_edge_of_lobe, neural, phong, sample, variables};
use support::{Differences, Traced, parameters, scale_of};

impl Batch for Traced {
    fn total(self) -> Self {
        self
    }
}

/// An inner loop and what judges it.
#[derive(Clone, Debug)]
struct Problem {
    initial: Vec<f64>,
    step_sizes: Vec<f64>,
    steps: usize,
    inner: Vec<Variables>,
    outer: Vec<Variables>,
}

/// Samples in equal weights, as the mean over all channels.
fn samples<S: Scalar>(list: &[Variables]) -> Vec<Sample<S>> {
    let weight = 1.0 / (3.0 * list.len() as f64);
    list.iter().map(|each| sample(*each, weight)).collect()
}

impl Problem {
    /// The outer loss, every branch on the way recorded.
    fn loss<M: Model>(&self) -> Traced {
        let traced = |list: &[f64]| -> Vec<Traced> { list.iter().copied().map(Traced).collect() };
        let inner = samples(&self.inner);
        let inner = Inner {
            samples: &[&inner[..]],
            steps: self.steps,
        };
        let learned = learn::<M, Traced, [Sample<Traced>]>(
            &traced(&self.initial),
            &traced(&self.step_sizes),
            &inner,
        );
        let zero = Traced(0.0);
        let mut gradient = parameters([], zero);
        samples(&self.outer).iter().fold(zero, |sum, sample| {
            sum + M::accumulate_gradient::<Traced, false>(&learned, sample, &mut gradient).loss
        })
    }
}

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
        let inner = samples(&problem.inner);
        let inner = Inner {
            samples: &[&inner[..]],
            steps: problem.steps,
        };
        let found = meta_gradient::<M, f64, [Sample<f64>], [Sample<f64>], true>(
            &problem.initial,
            &problem.step_sizes,
            &inner,
            &samples(&problem.outer)[..],
        );
        let loss = problem.loss::<M>().0;
        if (found.loss - loss).abs() > 1e-14 {
            return Err(format!("the loss is {} and not {loss}", found.loss));
        }

        let initial_scale = scale_of(&found.initial);
        let step_size_scale = scale_of(&found.step_sizes);
        for index in indices.iter().map(|index| index % M::PARAMETERS) {
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

        let by_samples: Vec<Variables> = found
            .samples
            .iter()
            .map(|by| {
                let [red, green, blue] = by.measured;
                [
                    by.at.hx, by.at.hz, by.at.dx, by.at.dy, by.at.dz, red, green, blue,
                ]
            })
            .collect();
        let scale = scale_of(by_samples.as_flattened());
        for (index, slopes) in by_samples.iter().enumerate() {
            if M::KIND == ModelKind::Phong && near_edge_of_lobe(problem.inner[index]) {
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
    initial: impl Strategy<Value = Vec<f64>>,
    log_step_sizes: std::ops::Range<f64>,
    steps: usize,
) {
    let compared = RefCell::new(Compared {
        initial: Differences::new(step),
        step_sizes: Differences::new(step),
        samples: Differences::new(step),
    });
    let config = ProptestConfig {
        cases: cases as u32,
        max_shrink_iters: 50,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let step_sizes = prop::collection::vec(log_step_sizes.prop_map(f64::exp), M::PARAMETERS);
    let inner = prop::collection::vec(variables(), 5);
    let outer = prop::collection::vec(variables(), 7);
    let indices = prop::collection::vec(0..usize::MAX, count);
    let outcome = TestRunner::new(config).run(
        &(initial, step_sizes, inner, outer, indices),
        |(initial, step_sizes, inner, outer, indices)| {
            let problem = Problem {
                initial,
                step_sizes,
                steps,
                inner,
                outer,
            };
            let mut compared = compared.borrow_mut();
            compared
                .compare::<M>(&problem, &indices)
                .map_err(TestCaseError::fail)
        },
    );
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
    samples.conclude(&format!("{name} by inner samples"), cases * 5 * 8 / 2);
}

#[test]
fn phong_meta_gradient_agrees_with_differences() {
    compare_many::<Phong>(200, 14, 5e-5, phong(), -4.0..0.0, 8);
}

#[test]
fn neural_meta_gradient_agrees_with_differences() {
    compare_many::<Neural>(40, 60, 1e-4, neural(), -6.0..-3.0, 5);
}
