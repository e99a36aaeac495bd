//! The meta-gradient of the model Linear, with respect to the pattern and the precision of each coefficient.
//!
//! Forward pass: evaluate the basis at the pattern, and factorize the ridge problem. For each material of a batch,
//! measure it at the pattern, map the readings, and solve for the coefficients. The loss is the mean over random
//! directions.
//!
//! Reverse pass: the gradient with respect to the coefficients propagates through the solve (two triangular solves in
//! core) to the basis, the measurements and the precisions, and then through the interpolation to the angles.
//!
//! A material has too small a loss if its basis contains it. Materials are therefore split into folds, and each
//! material is trained with the basis of all other folds. The final basis contains all materials.

mod task;

pub use task::{OuterBasis, OuterSamples, TaskGradient};

use glimpse_core::geometry::Angles;
use glimpse_materials::Material;
use glimpse_materials::basis::{AngleDual, angles_to_f64};
use glimpse_materials::sampling::uniform_valid;
use glimpse_optimizer::Groups;
use rand::Rng;
use rayon::prelude::*;

use super::objective::{LossEstimate, MetaObjective, RandomStreams};
use super::pattern::{Pattern, angles_above_horizon};
use super::phase::{InnerSamples, OuterStep, Phase};
use super::plan::Plan;
use crate::linear::principal_components;
use crate::linear::{Columns, Prior, ReducedBasis};

/// The number of folds.
const FOLDS: usize = 5;
/// The number of pool directions. The loss of a task uses a random selection of them.
const POOL: usize = 8_192;

/// The initial value of learned precisions.
const INITIAL_ETA: f64 = 4.0;

/// The objective of the model Linear.
pub struct LinearObjective<'a> {
    plan: &'a Plan,
    streams: RandomStreams,
    prior: Prior,
    materials: &'a [Box<dyn Material>],
    folds: Vec<OuterBasis>,
    /// The BRDF of each material at the directions of the pool, sr⁻¹.
    values: Vec<Vec<[f32; 3]>>,
}

impl<'a> LinearObjective<'a> {
    /// Evaluates the materials at the pool, and computes the basis of each fold.
    #[must_use]
    pub fn new(
        materials: &'a [Box<dyn Material>],
        columns: &Columns,
        prior: Prior,
        plan: &'a Plan,
        seed: u64,
    ) -> Self {
        let angles = uniform_valid(POOL, seed);
        let folds = FOLDS.min(materials.len());
        // A single material is trained with its own basis.
        let columns_outside =
            |fold: usize| columns.columns_of(|index| folds == 1 || index % folds != fold);
        let min_columns = (0..folds).map(|fold| columns_outside(fold).len()).min();
        let components = prior.components.min(min_columns.unwrap_or(0).max(2) - 1);
        let folds = (0..folds)
            .map(|fold| {
                OuterBasis::new(
                    principal_components(columns, &columns_outside(fold), components),
                    &angles,
                )
            })
            .collect();
        let values = materials
            .par_iter()
            .map(|material| angles.iter().map(|angles| material.brdf(*angles)).collect())
            .collect();
        Self {
            plan,
            streams: RandomStreams { seed },
            prior,
            materials,
            folds,
            values,
        }
    }

    /// Returns the number of components, m.
    #[must_use]
    pub fn components(&self) -> usize {
        self.folds.first().map_or(0, |fold| fold.basis.components())
    }

    /// Returns the mean loss of materials, each at given directions of the pool, and its gradient. The gradient is with
    /// respect to the logarithms of precisions and the logits of the pattern. It includes the barrier, the loss does
    /// not.
    #[must_use]
    pub fn batch_gradient(
        &self,
        pattern: &Pattern,
        log_precision: &[f32],
        tasks: &[(usize, Vec<u32>)],
    ) -> (f32, Groups<Vec<f32>>) {
        let sample_angles: Vec<Angles<f64>> = pattern
            .valid_angles()
            .map(|angles| angles_to_f64(&angles))
            .collect();
        let precision = precisions(log_precision);
        if sample_angles.is_empty() {
            return self.without_samples(pattern, precision.len(), tasks);
        }
        let reduced = self.reduced(&sample_angles);
        let factors: Vec<Vec<f64>> = reduced
            .iter()
            .map(|reduced| reduced.factorize(&precision))
            .collect();
        let gradients: Vec<TaskGradient> = tasks
            .par_iter()
            .map(|(material, directions)| {
                let fold = material % self.folds.len();
                let measured: Vec<[AngleDual; 3]> = pattern
                    .valid_angles()
                    .map(|angles| measure(&*self.materials[*material], angles))
                    .collect();
                let outer = OuterSamples {
                    basis: &self.folds[fold],
                    directions,
                    values: &self.values[*material],
                };
                let inputs = (&precision[..], &factors[fold][..]);
                TaskGradient::new(&reduced[fold], inputs, &measured, &outer)
            })
            .collect();

        let mut mean = TaskGradient {
            loss: 0.0,
            by_angles: vec![[0.0; 3]; sample_angles.len()],
            by_precision: vec![0.0; precision.len()],
        };
        for gradient in &gradients {
            mean.add(gradient, 1.0 / tasks.len() as f64);
        }
        let mut by_angles = mean.by_angles.into_iter();
        let by_logits = pattern.gradient_by_logits(|_| {
            let derivatives = by_angles.next().unwrap_or_default();
            derivatives.map(|derivative| derivative as f32)
        });
        let by_log_precision = mean
            .by_precision
            .iter()
            .zip(&precision)
            .map(|(derivative, precision)| (derivative * precision) as f32);
        let gradient = Groups {
            initial: Vec::new(),
            hyperparameters: by_log_precision.collect(),
            pattern: by_logits,
            ..Groups::default()
        };
        (mean.loss as f32, gradient)
    }

    /// Returns the mean loss and its gradient for a pattern without valid samples, which may occur at n = 1. All
    /// coefficients are 0, and only the barrier has a gradient.
    fn without_samples(
        &self,
        pattern: &Pattern,
        components: usize,
        tasks: &[(usize, Vec<u32>)],
    ) -> (f32, Groups<Vec<f32>>) {
        let coefficients = [(); 3].map(|()| vec![0.0; components]);
        let losses = tasks.iter().map(|(material, directions)| {
            let outer = OuterSamples {
                basis: &self.folds[material % self.folds.len()],
                directions,
                values: &self.values[*material],
            };
            outer.loss(&coefficients, None)
        });
        let gradient = Groups {
            initial: Vec::new(),
            hyperparameters: vec![0.0; components],
            pattern: pattern.gradient_by_logits(|_| [0.0; 3]),
            ..Groups::default()
        };
        let loss = losses.sum::<f64>() / tasks.len() as f64;
        (loss as f32, gradient)
    }

    /// Returns the loss of each material over the whole pool, with the basis of the other folds. All samples of the
    /// pattern must be valid.
    #[must_use]
    pub fn pool_losses(&self, pattern: &[Angles<f32>], log_precision: &[f32]) -> Vec<f64> {
        let sample_angles: Vec<Angles<f64>> = pattern.iter().map(angles_to_f64).collect();
        let precision = precisions(log_precision);
        let reduced = self.reduced(&sample_angles);
        let directions: Vec<u32> = (0..POOL as u32).collect();
        (0..self.materials.len())
            .into_par_iter()
            .map(|material| {
                let fold = material % self.folds.len();
                let brdf = pattern
                    .iter()
                    .map(|angles| self.materials[material].brdf(*angles));
                let measured: Vec<[f32; 3]> = brdf.collect();
                let outer = OuterSamples {
                    basis: &self.folds[fold],
                    directions: &directions,
                    values: &self.values[material],
                };
                outer.loss(&reduced[fold].fit(&precision, &measured), None)
            })
            .collect()
    }

    /// Returns the loss of each material, or NaN for diverged precisions.
    fn validation_losses(&self, values: &Groups<Vec<f32>>) -> Vec<f64> {
        let pattern = angles_above_horizon(&values.pattern);
        self.pool_losses(&pattern, &values.hyperparameters)
    }

    fn reduced(&self, sample_angles: &[Angles<f64>]) -> Vec<ReducedBasis> {
        let folds = self.folds.par_iter();
        folds
            .map(|fold| ReducedBasis::new(&fold.basis, sample_angles))
            .collect()
    }
}

fn mean_loss(losses: &[f64]) -> f32 {
    (losses.iter().sum::<f64>() / losses.len() as f64) as f32
}

impl MetaObjective for LinearObjective<'_> {
    fn initial_values(&self, guess: u64) -> Groups<Vec<f32>> {
        let samples = self.plan.phases.first().map_or(1, |phase| phase.samples);
        let eta = self.prior.eta.unwrap_or(INITIAL_ETA);
        Groups {
            initial: Vec::new(),
            hyperparameters: vec![eta.ln() as f32; self.components()],
            pattern: self.streams.initial_pattern(guess, samples),
            ..Groups::default()
        }
    }

    fn gradient(
        &self,
        values: &Groups<Vec<f32>>,
        outer_step: OuterStep<'_>,
    ) -> (f32, Groups<Vec<f32>>) {
        let phase = outer_step.phase;
        let batch = self.streams.batch(outer_step, self.materials.len());
        let slots = batch.into_iter().enumerate();
        let tasks: Vec<(usize, Vec<u32>)> = slots
            .map(|(slot, material)| {
                let mut random = self.streams.slot(outer_step, slot + 1);
                let draw = |_| random.random_range(0..POOL as u32);
                (material, (0..phase.outer_samples).map(draw).collect())
            })
            .collect();
        let pattern = match phase.inner_samples {
            InnerSamples::Pattern => Pattern::from_logits(&values.pattern),
            InnerSamples::Fresh(count) | InnerSamples::Fixed(count) => {
                let seed = self.streams.slot(outer_step, phase.batch + 1).random();
                Pattern::new(uniform_valid(count, seed))
            }
        };
        // A NaN loss, after precisions have diverged, is never selected as the best.
        let (loss, mut gradient) = self.batch_gradient(&pattern, &values.hyperparameters, &tasks);
        if phase.inner_samples != InnerSamples::Pattern {
            gradient.pattern.fill(0.0);
        }
        (loss, gradient)
    }

    fn fitness(&self, values: &Groups<Vec<f32>>, _: &Phase) -> f32 {
        self.validation_loss(values) + Pattern::from_logits(&values.pattern).barrier()
    }

    fn expected_loss(&self, values: &Groups<Vec<f32>>) -> LossEstimate {
        let losses = self.validation_losses(values);
        LossEstimate::new(mean_loss(&losses), losses.into_iter())
    }

    fn validation_loss(&self, values: &Groups<Vec<f32>>) -> f32 {
        mean_loss(&self.validation_losses(values))
    }
}

/// Returns a material's BRDF with its derivatives with respect to the angles.
fn measure(material: &dyn Material, angles: Angles<f32>) -> [AngleDual; 3] {
    let (brdf, derivatives) = material.brdf_with_derivative(angles);
    [0, 1, 2].map(|channel| AngleDual {
        value: f64::from(brdf[channel]),
        tangent: derivatives[channel].map(f64::from),
    })
}

fn precisions(logarithms: &[f32]) -> Vec<f64> {
    logarithms.iter().map(|log| f64::from(*log).exp()).collect()
}
