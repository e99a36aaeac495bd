//! The objective of schedule paper for models fitted by SGD: initial parameters, step sizes and pattern.

use glimpse_fitting::recipe::expected_loss::LossEstimate;
use glimpse_fitting::recipe::options::PretrainedInit;
use glimpse_kernels::ModelKernels;
use glimpse_kernels::inner_loop::InnerLoop;
use glimpse_materials::half_differences;
use glimpse_materials::sampling::sobol_valid;
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::objective::{InnerSamples, LossSamples, PaperObjective};
use crate::initialization::random_initialization;
use crate::outer::{MetaValues, OuterStep, scaled_sum};
use crate::pattern::{Reach, SamplePattern};
use crate::streams::RandomStreams;
use crate::tasks::pool::WarpedPool;
use crate::tasks::samples::WeightedSamples;
use crate::tasks::task::TrainingTask;

/// The initial step size of all parameters.
const INITIAL_STEP_SIZE: f32 = 1e-3;

/// The objective of a model fitted by SGD.
pub struct DescentObjective<'a> {
    /// The model.
    pub kernels: &'static ModelKernels,
    /// The training materials.
    pub training: &'a WarpedPool,
    /// The materials of the validation loss.
    pub validation: &'a WarpedPool,
    /// Initial parameters and step sizes in place of random ones.
    pub pretrained: Option<&'a PretrainedInit>,
    /// The number of inner steps, K.
    pub inner_steps: usize,
    /// The random number streams.
    pub streams: RandomStreams,
}

/// Measures a material of a pool at a pattern. Samples below the horizon have no weight.
fn measure<'p>(
    pool: &WarpedPool,
    material: usize,
    pattern: &'p SamplePattern,
) -> WeightedSamples<'p> {
    let material = &pool.materials[material];
    let samples = pattern.angles.iter().zip(&pattern.valid);
    let brdf = samples.map(|(angles, valid)| {
        if *valid {
            material.at_angles(*angles)
        } else {
            [0.0; 3]
        }
    });
    let brdf: Vec<[f32; 3]> = brdf.collect();
    WeightedSamples::present(&pattern.octet_directions, &brdf, &pattern.valid)
}

impl PaperObjective for DescentObjective<'_> {
    fn initial_values(&self) -> MetaValues {
        let (initial, step_sizes) = match self.pretrained {
            Some(pretrained) => (pretrained.initial.clone(), pretrained.step_sizes.clone()),
            None => {
                let initial = self.live_initialization();
                let step_sizes = vec![INITIAL_STEP_SIZE; initial.len()];
                (initial, step_sizes)
            }
        };
        Groups {
            initial,
            hyperparameters: step_sizes,
            ..Groups::default()
        }
    }

    fn gradient(
        &self,
        values: &MetaValues,
        outer_step: OuterStep,
        samples: LossSamples,
    ) -> (f32, MetaValues) {
        let pattern = Reach::ANY.pattern(&values.pattern);
        let tasks = self.training.materials.len();
        let batch = self.streams.batch(outer_step, tasks);
        let gradients = batch.par_iter().enumerate().map(|(slot, task)| {
            let mut random = self.streams.slot(outer_step, slot + 1);
            self.task_gradient(samples, values, &pattern, *task, &mut random)
        });
        scaled_sum(1.0 / batch.len() as f32, &gradients.collect::<Vec<_>>())
    }

    fn expected_loss(&self, values: &MetaValues) -> LossEstimate {
        let pattern = Reach::ANY.reachable_pattern(&values.pattern);
        let pool = self.validation;
        let losses = (0..pool.materials.len()).into_par_iter().map(|index| {
            let measured = measure(pool, index, &pattern);
            let parameters = (self.kernels.descend)(&self.inner_loop(values), &measured.octets());
            let all = TrainingTask::plain(index, 0, pool.octet_count());
            (self.kernels.loss)(&parameters, &all.samples(pool).octets())
        });
        LossEstimate::of(&losses.collect::<Vec<_>>())
    }
}

impl DescentObjective<'_> {
    /// Returns that of 64 random initializations which is 0 in the fewest channels and directions. An output of Neural
    /// that is 0 in all directions has no gradient, and never recovers.
    fn live_initialization(&self) -> Vec<f32> {
        let at = half_differences(sobol_valid(64, 0));
        let dark = |initial: &Vec<f32>| {
            let mut brdf = vec![[0.0; 3]; at.len()];
            (self.kernels.evaluate)(initial, &at, &mut brdf);
            let channels = brdf.iter().flatten();
            channels.filter(|channel| **channel <= 0.0).count()
        };
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(0));
        let draws = (0..64).map(|_| random_initialization(self.kernels.model, &mut random));
        draws.min_by_key(dark).unwrap_or_default()
    }

    fn inner_loop<'v>(&self, values: &'v MetaValues) -> InnerLoop<'v, f32> {
        InnerLoop {
            initial: &values.initial,
            step_sizes: &values.hyperparameters,
            steps: self.inner_steps,
        }
    }

    fn task_gradient(
        &self,
        samples: LossSamples,
        values: &MetaValues,
        pattern: &SamplePattern,
        material: usize,
        random: &mut ChaCha8Rng,
    ) -> (f32, MetaValues) {
        let pool = self.training;
        let mut draw = |count| {
            let task = TrainingTask {
                octets: pool.draw(count, random),
                ..TrainingTask::plain(material, 0, 0)
            };
            task.samples(pool)
        };
        let inner_loop = self.inner_loop(values);
        let outer = draw(samples.outer);
        let outer = outer.octets();
        let mut by_pattern = vec![0.0; 3 * pattern.angles.len()];
        let gradient = match samples.inner {
            InnerSamples::Pattern => {
                let measured = measure(pool, material, pattern);
                let inner = measured.octets();
                let mut derivatives = inner.zero_derivatives();
                let lists = &[inner];
                let gradient = (self.kernels.meta_gradient)(
                    &inner_loop,
                    lists,
                    &outer,
                    Some(&mut derivatives),
                );
                // A sample's angles also change its measured value. The gradient of a fit's log loss depends on that
                // value only through the sign of model minus measurement, so the corresponding derivative is 0.
                by_pattern = pattern
                    .gradient_by_logits(|index| pattern.gradient_by_angles(&derivatives, index));
                gradient
            }
            InnerSamples::Fresh(count) => {
                let draws: Vec<_> = (0..inner_loop.steps).map(|_| draw(count)).collect();
                let inner: Vec<_> = draws.iter().map(|draw| draw.octets()).collect();
                (self.kernels.meta_gradient)(&inner_loop, &inner, &outer, None)
            }
        };
        let gradients = Groups {
            initial: gradient.initial,
            hyperparameters: gradient.step_sizes,
            pattern: by_pattern,
            ..Groups::default()
        };
        (gradient.loss, gradients)
    }
}
