//! The objective of schedule paper for models fitted by SGD: initial parameters, step sizes and pattern.

use std::marker::PhantomData;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ParameterSet;
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient, unflatten};
use glimpse_materials::sampling::sobol_valid;
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::completion::pool::WarpedPool;
use super::completion::task::Task;
use super::initialization::random_initialization;
use super::objective::{
    InnerSamples, LossEstimate, LossSamples, PaperObjective, RandomStreams, mean_gradient,
};
use super::pattern::{Pattern, angles_above_horizon};
use super::phase::{OuterStep, Values};
use super::plan::PretrainedInit;
use super::samples::WeightedSamples;

/// The initial step size of all parameters.
const INITIAL_STEP_SIZE: f32 = 1e-3;

/// The objective of a model fitted by SGD.
pub struct DescentObjective<'a, M: LaneModel> {
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
    /// The model.
    pub model: PhantomData<M>,
}

/// Returns that of 64 random initializations which is 0 in the fewest channels and directions. An output of Neural that is
/// 0 in all directions has no gradient, and never recovers.
fn live_initialization<M: LaneModel>(random: &mut ChaCha8Rng) -> Vec<f32> {
    let at: Vec<HalfDifference<f32>> = sobol_valid(64, 0)
        .into_iter()
        .map(HalfDifference::from_angles)
        .collect();
    let dark = |initial: &Vec<f32>| {
        let mut parameters = M::Parameters::filled(0.0);
        unflatten(initial, &mut parameters);
        let mut brdf = vec![[0.0; 3]; at.len()];
        M::evaluate(&parameters, &at, &mut brdf);
        let channels = brdf.iter().flatten();
        channels.filter(|channel| **channel <= 0.0).count()
    };
    let initializations = (0..64).map(|_| random_initialization(M::KIND, random));
    initializations.min_by_key(dark).unwrap_or_default()
}

/// Measures a material of a pool at a pattern. Samples below the horizon have no weight.
fn measure<'p>(pool: &WarpedPool, material: usize, pattern: &'p Pattern) -> WeightedSamples<'p> {
    let material = &pool.materials()[material];
    let samples = pattern.angles().iter().zip(pattern.valid());
    let brdf = samples.map(|(angles, valid)| match valid {
        true => material.at_angles(*angles),
        false => [0.0; 3],
    });
    let brdf: Vec<[f32; 3]> = brdf.collect();
    WeightedSamples::present(pattern.octet_directions(), &brdf, pattern.valid())
}

impl<M: LaneModel> PaperObjective for DescentObjective<'_, M> {
    fn initial_values(&self) -> Values {
        let (initial, step_sizes) = match self.pretrained {
            Some(pretrained) => (pretrained.initial.clone(), pretrained.step_sizes.clone()),
            None => {
                let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(0));
                let initial = live_initialization::<M>(&mut random);
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
        values: &Values,
        outer_step: OuterStep,
        samples: LossSamples,
    ) -> (f32, Values) {
        let inner_loop = self.inner_loop(values);
        let pattern = Pattern::from_logits(&values.pattern);
        let batch = self
            .streams
            .batch(outer_step, self.training.materials().len());
        let batch = batch.par_iter().enumerate();
        let gradients = batch.map(|(slot, task)| {
            let mut random = self.streams.slot(outer_step, slot + 1);
            self.task_gradient(samples, &inner_loop, &pattern, *task, &mut random)
        });
        mean_gradient(&gradients.collect::<Vec<_>>())
    }

    fn expected_loss(&self, values: &Values) -> LossEstimate {
        let inner_loop = self.inner_loop(values);
        let pattern = Pattern::new(angles_above_horizon(&values.pattern));
        let pool = self.validation;
        let losses = (0..pool.materials().len()).into_par_iter().map(|index| {
            let parameters = M::fit(&inner_loop, &measure(pool, index, &pattern).octets());
            let all = Task::plain(index, 0, pool.octet_count());
            M::loss(&parameters, &all.samples(pool).octets())
        });
        let losses: Vec<f32> = losses.collect();
        let mean = losses.iter().sum::<f32>() / losses.len() as f32;
        LossEstimate::new(mean, losses.iter().copied().map(f64::from))
    }
}

impl<M: LaneModel> DescentObjective<'_, M> {
    fn inner_loop(&self, values: &Values) -> InnerLoop<M, f32> {
        InnerLoop::new(&values.initial, &values.hyperparameters, self.inner_steps)
    }

    fn task_gradient(
        &self,
        samples: LossSamples,
        inner_loop: &InnerLoop<M, f32>,
        pattern: &Pattern,
        material: usize,
        random: &mut ChaCha8Rng,
    ) -> (f32, Values) {
        let pool = self.training;
        let mut draw = |count| {
            let task = Task {
                octets: pool.draw(count, random),
                ..Task::plain(material, 0, 0)
            };
            task.samples(pool)
        };
        let outer = draw(samples.outer);
        let outer = outer.octets();
        let mut by_pattern = vec![0.0; 3 * pattern.angles().len()];
        let mut meta_gradient = MetaGradient::<M, f32>::default();
        let loss = match samples.inner {
            InnerSamples::Pattern => {
                let measured = measure(pool, material, pattern);
                let inner = measured.octets();
                let mut derivatives = inner.zero_derivatives();
                let loss = M::meta_gradient(
                    &mut meta_gradient,
                    inner_loop,
                    &[inner],
                    &outer,
                    Some(&mut derivatives),
                );
                // A sample's angles also change its measured value. The gradient of a fit's log loss depends on that
                // value only through the sign of model minus measurement, so the corresponding derivative is 0.
                by_pattern = pattern
                    .gradient_by_logits(|index| pattern.gradient_by_angles(&derivatives, index));
                loss
            }
            InnerSamples::Fresh(count) => {
                let draws: Vec<_> = (0..inner_loop.steps).map(|_| draw(count)).collect();
                let inner: Vec<_> = draws.iter().map(|draw| draw.octets()).collect();
                M::meta_gradient(&mut meta_gradient, inner_loop, &inner, &outer, None)
            }
        };
        let gradients = Groups {
            initial: meta_gradient.initial.iter().copied().collect(),
            hyperparameters: meta_gradient.step_sizes.iter().copied().collect(),
            pattern: by_pattern,
            ..Groups::default()
        };
        (loss, gradients)
    }
}
