//! Models that are fitted by descent, as a [`MetaObjective`]: initial parameters, step sizes, pattern.

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
use super::objective::{Expected, MetaObjective, RandomStreams, mean};
use super::pattern::{Pattern, above_horizon};
use super::phase::{InnerSamples, OuterStep, Phase};
use super::plan::{LossWeights, Plan};
use super::pool::{Draw, Pool};

/// Materials, and their values at a pool of directions.
pub struct Tasks<'a> {
    /// The materials.
    pub materials: &'a [Box<dyn Material>],
    /// Their values.
    pub pool: Pool,
}

/// Lists of random samples that each material is learned on where fitness is of random samples.
const RANDOM_LISTS: usize = 3;

/// A model that is fitted by descent.
pub struct DescentObjective<'a, M: LaneModel> {
    /// What it is trained on.
    pub training: &'a Tasks<'a>,
    /// What it is judged on.
    pub validation: &'a Tasks<'a>,
    /// The phases, and where they begin.
    pub plan: &'a Plan,
    /// Inner steps, K.
    pub inner_steps: usize,
    /// All random numbers.
    pub streams: RandomStreams,
    /// The model.
    pub model: PhantomData<M>,
}

fn mean_loss(losses: &[f32]) -> f32 {
    losses.iter().sum::<f32>() / losses.len() as f32
}

impl<M: LaneModel> MetaObjective for DescentObjective<'_, M> {
    fn first_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let form = self.plan.step_size_form;
        let (initial, step_sizes) = match &self.plan.known {
            Some(known) => {
                let values = known.step_sizes.iter().map(|alpha| form.value(*alpha));
                (known.initial.clone(), values.collect())
            }
            None => {
                let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess(guess));
                let initial = (self.plan.first_guess)(M::KIND, &mut random);
                let step_size = form.value(self.plan.first_step_size);
                let step_sizes = vec![step_size; initial.len()];
                (initial, step_sizes)
            }
        };
        let samples = self.plan.phases.first().map_or(1, |phase| phase.samples);
        Groups {
            initial,
            hyperparameters: step_sizes,
            pattern: self.streams.first_pattern(guess, samples),
            ..Groups::default()
        }
    }

    fn gradient(&self, values: &Groups<Vec<f32>>, at: OuterStep<'_>) -> (f32, Groups<Vec<f32>>) {
        let (inner_loop, step_sizes) = self.inner_loop(values);
        let pattern = Pattern::from_logits(&values.pattern);
        let tasks = self.training.materials.len();
        let found: Vec<_> = self
            .streams
            .batch(at, tasks)
            .par_iter()
            .enumerate()
            .map(|(slot, task)| {
                let mut random = self.streams.slot(at, slot + 1);
                self.task_gradient(at.phase, &inner_loop, &pattern, *task, &mut random)
            })
            .collect();
        let (loss, mut gradient) = mean(&found);
        let form = self.plan.step_size_form;
        form.chain(&mut gradient.hyperparameters, &step_sizes);
        (loss, gradient)
    }

    fn fitness(&self, values: &Groups<Vec<f32>>, phase: &Phase) -> f32 {
        let (inner_loop, _) = self.inner_loop(values);
        let pattern = Pattern::from_logits(&values.pattern);
        let Tasks { materials, pool } = self.training;
        let loss_of = |index: usize| {
            let outer = pool.octets_from(index, 0, phase.outer);
            let after = |inner: &Draw<'_>| M::fit(&inner_loop, &inner.octets());
            let loss = match phase.inner {
                InnerSamples::Pattern => {
                    let measured = pattern.measure(&*materials[index]);
                    M::loss(&M::fit(&inner_loop, &measured.octets()), &outer.octets())
                }
                InnerSamples::Fresh(count) | InnerSamples::Random(count) => {
                    // Behind the outer samples, others for each material.
                    let octets = count.div_ceil(WIDTH);
                    let lists = (0..RANDOM_LISTS).map(|list| {
                        let first = outer.len() + (index * RANDOM_LISTS + list) * octets;
                        let inner = pool.octets_from(index, first, count);
                        M::loss(&after(&inner), &outer.octets())
                    });
                    lists.sum::<f32>() / RANDOM_LISTS as f32
                }
            };
            self.plan.weighing.weight(pool.loss_of_black(index)) * loss
        };
        let losses: f32 = (0..materials.len()).map(loss_of).sum();
        let barrier = match phase.inner {
            InnerSamples::Pattern => pattern.barrier(),
            _ => 0.0,
        };
        losses / materials.len() as f32 + barrier
    }

    fn judge(&self, values: &Groups<Vec<f32>>) -> f32 {
        mean_loss(&self.validated(values, self.plan.weighing))
    }

    fn expected(&self, values: &Groups<Vec<f32>>) -> Expected {
        let losses = self.validated(values, LossWeights::Equal);
        Expected::new(mean_loss(&losses), losses.iter().copied().map(f64::from))
    }
}

impl<M: LaneModel> DescentObjective<'_, M> {
    /// The inner_loop that meta-parameters describe, and its step sizes.
    fn inner_loop(&self, values: &Groups<Vec<f32>>) -> (InnerLoop<M, f32>, Vec<f32>) {
        let step_sizes = self.plan.step_size_form.step_sizes(&values.hyperparameters);
        let inner_loop = InnerLoop::new(&values.initial, &step_sizes, self.inner_steps);
        (inner_loop, step_sizes)
    }

    /// The loss of each material held out.
    fn validated(&self, values: &Groups<Vec<f32>>, weighing: LossWeights) -> Vec<f32> {
        let (inner_loop, _) = self.inner_loop(values);
        let pattern = Pattern::new(above_horizon(&values.pattern));
        let Tasks { materials, pool } = self.validation;
        materials
            .par_iter()
            .enumerate()
            .map(|(index, material)| {
                let parameters = M::fit(&inner_loop, &pattern.measure(&**material).octets());
                let loss = M::loss(&parameters, &pool.all(index).octets());
                weighing.weight(pool.loss_of_black(index)) * loss
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
        let Tasks { materials, pool } = self.training;
        let partners = materials.len();
        let augmentation = phase
            .gain
            .map(|gain| Augmentation::random(gain, partners, random));
        let mut draw = |count| match &augmentation {
            Some(augmentation) => pool.draw_varied(task, augmentation, count, random),
            None => pool.draw(task, count, random),
        };
        let outer = draw(phase.outer);
        let outer = outer.octets();
        let mut by_pattern = vec![0.0; 3 * pattern.angles().len()];
        let mut found = MetaGradient::<M, f32>::default();
        let loss = match phase.inner {
            InnerSamples::Pattern => {
                let material = &*materials[task];
                let measured = match &augmentation {
                    Some(augmentation) => {
                        let partner = &*materials[augmentation.partner];
                        pattern.measure_varied(material, partner, augmentation)
                    }
                    None => pattern.measure(material),
                };
                let inner = measured.octets();
                let mut derivatives = inner.zero_derivatives();
                let list = [&inner];
                let loss = M::meta_gradient(
                    &mut found,
                    inner_loop,
                    &list,
                    &outer,
                    Some(&mut derivatives),
                );
                by_pattern = measured.gradient_by_logits(&derivatives);
                loss
            }
            InnerSamples::Fresh(count) | InnerSamples::Random(count) => {
                let lists = match phase.inner {
                    InnerSamples::Fresh(_) => inner_loop.steps,
                    _ => 1,
                };
                let draws: Vec<Draw<'_>> = (0..lists).map(|_| draw(count)).collect();
                let inner: Vec<_> = draws.iter().map(|draw| draw.octets().in_a_row()).collect();
                let inner: Vec<_> = inner.iter().collect();
                M::meta_gradient(&mut found, inner_loop, &inner, &outer, None)
            }
        };
        let weight = self.plan.weighing.weight_of(&outer);
        let weighed = |entry: &f32| weight * entry;
        let gradients = Groups {
            initial: found.initial.iter().map(weighed).collect(),
            hyperparameters: found.step_sizes.iter().map(weighed).collect(),
            pattern: by_pattern.iter().map(weighed).collect(),
            ..Groups::default()
        };
        (weight * loss, gradients)
    }
}
