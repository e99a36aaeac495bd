//! The [`MetaObjective`] of models fitted by gradient descent: initial parameters, step sizes and pattern.

use std::marker::PhantomData;

use glimpse_core::model::ParameterSet;
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient};
use glimpse_kernels::lanes::WIDTH;
use glimpse_materials::Material;
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::augmentation::Augmentation;
use super::objective::{LossEstimate, MetaObjective, RandomStreams, mean_gradient};
use super::pattern::{Pattern, angles_above_horizon};
use super::phase::{InnerSamples, OuterStep, Phase};
use super::plan::{LossWeights, Plan};
use super::pool::{DrawnSamples, Pool};

/// Materials, with their BRDF at a pool of directions.
pub struct TaskSet<'a> {
    /// The materials.
    pub materials: &'a [Box<dyn Material>],
    /// The BRDFs.
    pub pool: Pool,
}

/// The number of lists of fixed random samples per material. The fitness is the mean over these lists.
const FIXED_LISTS: usize = 3;

/// The objective of a model fitted by gradient descent.
pub struct DescentObjective<'a, M: LaneModel> {
    /// The training materials.
    pub training: &'a TaskSet<'a>,
    /// The materials of the validation loss.
    pub validation: &'a TaskSet<'a>,
    /// The phases and initial values.
    pub plan: &'a Plan,
    /// The number of inner steps, K.
    pub inner_steps: usize,
    /// The random number streams.
    pub streams: RandomStreams,
    /// The model.
    pub model: PhantomData<M>,
}

fn mean_loss(losses: &[f32]) -> f32 {
    losses.iter().sum::<f32>() / losses.len() as f32
}

impl<M: LaneModel> MetaObjective for DescentObjective<'_, M> {
    fn initial_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let encoding = self.plan.step_size_encoding;
        let (initial, step_sizes) = match &self.plan.pretrained {
            Some(pretrained) => {
                let values = pretrained
                    .step_sizes
                    .iter()
                    .map(|alpha| encoding.encode(*alpha));
                (pretrained.initial.clone(), values.collect())
            }
            None => {
                let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(guess));
                let initial = (self.plan.initial_parameters)(M::KIND, &mut random);
                let step_size = encoding.encode(self.plan.initial_step_size);
                let step_sizes = vec![step_size; initial.len()];
                (initial, step_sizes)
            }
        };
        let samples = self.plan.phases.first().map_or(1, |phase| phase.samples);
        Groups {
            initial,
            hyperparameters: step_sizes,
            pattern: self.streams.initial_pattern(guess, samples),
            ..Groups::default()
        }
    }

    fn gradient(
        &self,
        values: &Groups<Vec<f32>>,
        outer_step: OuterStep<'_>,
    ) -> (f32, Groups<Vec<f32>>) {
        let (inner_loop, step_sizes) = self.inner_loop(values);
        let pattern = Pattern::from_logits(&values.pattern);
        let tasks = self.training.materials.len();
        let gradients: Vec<_> = self
            .streams
            .batch(outer_step, tasks)
            .par_iter()
            .enumerate()
            .map(|(slot, task)| {
                let mut random = self.streams.slot(outer_step, slot + 1);
                self.task_gradient(outer_step.phase, &inner_loop, &pattern, *task, &mut random)
            })
            .collect();
        let (loss, mut gradient) = mean_gradient(&gradients);
        let encoding = self.plan.step_size_encoding;
        encoding.chain_rule(&mut gradient.hyperparameters, &step_sizes);
        (loss, gradient)
    }

    fn fitness(&self, values: &Groups<Vec<f32>>, phase: &Phase) -> f32 {
        let (inner_loop, _) = self.inner_loop(values);
        let pattern = Pattern::from_logits(&values.pattern);
        let TaskSet { materials, pool } = self.training;
        let weighted_loss = |index: usize| {
            let outer = pool.octets_from(index, 0, phase.outer_samples);
            let loss = match phase.inner_samples {
                InnerSamples::Pattern => {
                    let measured = pattern.measure(&*materials[index]);
                    M::loss(&M::fit(&inner_loop, &measured.octets()), &outer.octets())
                }
                InnerSamples::Fresh(count) | InnerSamples::Fixed(count) => {
                    // The inner samples follow the outer samples in the pool, and differ between materials.
                    let octets = count.div_ceil(WIDTH);
                    let lists = (0..FIXED_LISTS).map(|list| {
                        let first = outer.len() + (index * FIXED_LISTS + list) * octets;
                        let inner = pool.octets_from(index, first, count);
                        M::loss(&M::fit(&inner_loop, &inner.octets()), &outer.octets())
                    });
                    lists.sum::<f32>() / FIXED_LISTS as f32
                }
            };
            self.plan.loss_weights.weight(pool.loss_of_black(index)) * loss
        };
        let losses: f32 = (0..materials.len()).map(weighted_loss).sum();
        let barrier = match phase.inner_samples {
            InnerSamples::Pattern => pattern.barrier(),
            _ => 0.0,
        };
        losses / materials.len() as f32 + barrier
    }

    fn validation_loss(&self, values: &Groups<Vec<f32>>) -> f32 {
        mean_loss(&self.validation_losses(values, self.plan.loss_weights))
    }

    fn expected_loss(&self, values: &Groups<Vec<f32>>) -> LossEstimate {
        let losses = self.validation_losses(values, LossWeights::Equal);
        LossEstimate::new(mean_loss(&losses), losses.iter().copied().map(f64::from))
    }
}

impl<M: LaneModel> DescentObjective<'_, M> {
    /// Returns the inner loop of given meta-parameters, and its step sizes.
    fn inner_loop(&self, values: &Groups<Vec<f32>>) -> (InnerLoop<M, f32>, Vec<f32>) {
        let step_sizes = self.plan.step_size_encoding.decode(&values.hyperparameters);
        let inner_loop = InnerLoop::new(&values.initial, &step_sizes, self.inner_steps);
        (inner_loop, step_sizes)
    }

    /// Returns the weighted loss of each validation material.
    fn validation_losses(&self, values: &Groups<Vec<f32>>, loss_weights: LossWeights) -> Vec<f32> {
        let (inner_loop, _) = self.inner_loop(values);
        let pattern = Pattern::new(angles_above_horizon(&values.pattern));
        let TaskSet { materials, pool } = self.validation;
        materials
            .par_iter()
            .enumerate()
            .map(|(index, material)| {
                let parameters = M::fit(&inner_loop, &pattern.measure(&**material).octets());
                let loss = M::loss(&parameters, &pool.all(index).octets());
                loss_weights.weight(pool.loss_of_black(index)) * loss
            })
            .collect()
    }

    fn task_gradient(
        &self,
        phase: &Phase,
        inner_loop: &InnerLoop<M, f32>,
        pattern: &Pattern,
        task: usize,
        random: &mut ChaCha8Rng,
    ) -> (f32, Groups<Vec<f32>>) {
        let TaskSet { materials, pool } = self.training;
        let partners = materials.len();
        let augmentation = phase
            .augmentation_gain
            .map(|gain| Augmentation::random(gain, partners, random));
        let mut draw = |count| match &augmentation {
            Some(augmentation) => pool.draw_augmented(task, augmentation, count, random),
            None => pool.draw(task, count, random),
        };
        let outer_draw = draw(phase.outer_samples);
        let outer = outer_draw.octets();
        let mut by_pattern = vec![0.0; 3 * pattern.angles().len()];
        let mut meta_gradient = MetaGradient::<M, f32>::default();
        let loss = match phase.inner_samples {
            InnerSamples::Pattern => {
                let material = &*materials[task];
                let measured = match &augmentation {
                    Some(augmentation) => {
                        let partner = &*materials[augmentation.partner];
                        pattern.measure_augmented(material, partner, augmentation)
                    }
                    None => pattern.measure(material),
                };
                let inner = measured.octets();
                let mut derivatives = inner.zero_derivatives();
                let loss = M::meta_gradient(
                    &mut meta_gradient,
                    inner_loop,
                    &[&inner],
                    &outer,
                    Some(&mut derivatives),
                );
                by_pattern = measured.gradient_by_logits(&derivatives);
                loss
            }
            InnerSamples::Fresh(count) | InnerSamples::Fixed(count) => {
                let list_count = match phase.inner_samples {
                    InnerSamples::Fresh(_) => inner_loop.steps,
                    _ => 1,
                };
                let draws: Vec<DrawnSamples<'_>> = (0..list_count).map(|_| draw(count)).collect();
                let lists: Vec<_> = draws
                    .iter()
                    .map(|draw| draw.octets().back_to_back())
                    .collect();
                let inner: Vec<_> = lists.iter().collect();
                M::meta_gradient(&mut meta_gradient, inner_loop, &inner, &outer, None)
            }
        };
        let weight = self.plan.loss_weights.task_weight(&outer);
        let weighted = |entry: &f32| weight * entry;
        let gradients = Groups {
            initial: meta_gradient.initial.iter().map(weighted).collect(),
            hyperparameters: meta_gradient.step_sizes.iter().map(weighted).collect(),
            pattern: by_pattern.iter().map(weighted).collect(),
            ..Groups::default()
        };
        (weight * loss, gradients)
    }
}
