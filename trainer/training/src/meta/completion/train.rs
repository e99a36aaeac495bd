//! Training with schedule prior: one run on all materials, then one run per fold to estimate the expected loss.

use std::ops::ControlFlow;

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::ValidationSplit;
use glimpse_kernels::completion::Shape;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material, Procedural};
use glimpse_optimizer::Groups;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::dataset::{Dataset, Subset};
use super::loss_predictor::{Evidence, HeldOutLoss, HeldOutOrigin, LossPredictor};
use super::objective::{CompletionObjective, hyperparameters};
use super::reading::{LOG_SCALE, Standardization};
use super::refinement::Refinement;
use super::task::{AugmentationOptions, Dropout, MaterialGroup, Task};
use crate::linear::RecipeBasis;
use crate::meta::identity::RunIdentity;
use crate::meta::learned::{
    CompletionTarget, LearnedCoefficientNet, LearnedCorrection, LearnedFit, LearnedRecipe,
    ValidatedLoss,
};
use crate::meta::objective::{LossEstimate, RandomStreams};
use crate::meta::options::{CompletionOptions, Options};
use crate::meta::outer::{Observer, Outcome, OuterLoop, Progress, RunError};
use crate::meta::pattern::reachable_angles;
use crate::meta::plan::Plan;

/// The number of SGD steps from the initial parameters of the InitNet.
pub const SGD_STEPS: usize = 1;
/// The number of Gauss-Newton steps from these parameters.
pub const GAUSS_NEWTON_STEPS: usize = 2;
/// The number of coefficients, m.
const COMPONENTS: usize = 24;
/// The number of components of the correction, K, for the model Linear with more samples than a device fits.
const MAX_CORRECTED_COMPONENTS: usize = 120;
/// The largest number of samples with [`COMPONENTS`] in the correction.
const MAX_DEVICE_SAMPLES: usize = 64;
/// The number of hidden units of the CoefficientNet, h.
const HIDDEN_UNITS: usize = 64;
/// The number of hidden units of the InitNet, g.
const INIT_NET_UNITS: usize = 32;
/// The weight of the loss before the descent in the gradient, for models fitted by descent. The weight of the loss
/// after the descent is 1.
const AUXILIARY_WEIGHT: f32 = 0.3;
/// The maximum number of pool directions. With thousands of materials the pool is smaller; see [`pool_size`].
const MAX_POOL_SIZE: usize = 8_192;
/// The maximum memory of the pool in bytes, enough for 4,096 materials at all directions.
const MAX_POOL_BYTES: usize = 3 << 30;
/// The number of folds.
const FOLDS: usize = 4;
/// The minimum number of materials to form folds.
const MIN_MATERIALS_FOR_FOLDS: usize = 10;
/// The number of rough tasks per fold for the loss predictor.
const ROUGH_TASKS: usize = 1_024;
/// The number of outer samples of each rough task.
const ROUGH_OUTER_SAMPLES: usize = 1_024;

/// Trains a recipe on all materials. Then trains once per fold on the materials outside the fold, to estimate the loss
/// on unseen materials.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub fn train(
    options: &Options,
    plan: &Plan,
    refinement: Option<&dyn Refinement>,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, RunError> {
    let identities: Vec<Identity> = materials
        .iter()
        .map(|each| Identity::new(&**each))
        .collect();
    let identity = options.identity(&identities);
    let dataset = dataset(materials, options);
    let folds = folds(dataset.training_count, options.seed);
    let fold_plan = Plan::for_fold(
        options.effort,
        options.model,
        options.samples,
        dataset.training_count,
    );
    let mut session = Session {
        options,
        identity,
        refinement,
        dataset: &dataset,
        total: plan.steps() + folds.len() * fold_plan.steps(),
        done: 0,
        observer,
    };

    let components = corrected_components(options);
    let all = Subset::all(&dataset, components);
    let (
        objective,
        Outcome {
            expected_loss,
            values,
        },
    ) = session.run(&all, plan, None, 0)?;
    let shape = objective.shape;
    let training_materials: Vec<usize> = (0..dataset.training_count).collect();
    let full_losses = objective.material_losses(&values, &training_materials);
    let mut held_out_losses = Vec::new();
    let mut correction = FoldCorrection::default();
    for (index, fold) in folds.iter().enumerate() {
        // The classes of procedural materials that are left out with the fold.
        let classes: Vec<usize> = (dataset.training_count..dataset.materials.len())
            .filter(|each| dataset.classes[each - dataset.training_count] % FOLDS == index)
            .collect();
        let held_out = [&fold[..], &classes].concat();
        let subset = Subset::without(&dataset, components, &held_out);
        let (fold_objective, outcome) =
            session.run(&subset, &fold_plan, Some(&values), index + 1)?;
        let others: Vec<usize> = training_materials
            .iter()
            .copied()
            .filter(|material| !fold.contains(material))
            .collect();
        correction.add(
            others.iter().map(|index| full_losses[*index]),
            fold_objective.material_losses(&outcome.values, &others),
        );
        let plain_tasks = |materials: &[usize]| -> Vec<Task> {
            let tasks = materials.iter();
            tasks
                .map(|each| Task::plain(*each, options.samples, 0))
                .collect()
        };
        let evidence = EvidenceCorrection::new(
            &objective.evidence(&values, &plain_tasks(&others)),
            &fold_objective.evidence(&outcome.values, &plain_tasks(&others)),
        );
        let rough_tasks = rough_tasks(&dataset, [fold, &classes], index, options);
        for (tasks, losses, origin) in [
            (
                &plain_tasks(fold),
                fold_objective.material_losses(&outcome.values, fold),
                HeldOutOrigin::Material,
            ),
            (
                &plain_tasks(&classes),
                fold_objective.material_losses(&outcome.values, &classes),
                HeldOutOrigin::Class,
            ),
            (
                &rough_tasks,
                fold_objective.task_losses(&outcome.values, &rough_tasks),
                HeldOutOrigin::Rough,
            ),
        ] {
            let results = objective
                .mean_coefficients(&values, tasks)
                .into_iter()
                .zip(fold_objective.evidence(&outcome.values, tasks))
                .zip(losses)
                .zip(tasks);
            held_out_losses.extend(results.map(|(((coefficients, each), loss), task)| {
                HeldOutLoss {
                    material: task.material,
                    coefficients,
                    evidence: evidence.correct(each),
                    loss,
                    origin,
                    fold: index,
                }
            }));
        }
    }
    for held_out_loss in &mut held_out_losses {
        held_out_loss.loss *= correction.ratio();
    }
    let expected_loss = validated_loss(expected_loss, &held_out_losses);
    let pattern = reachable_angles(&values.pattern, &options.completion_options.limits);
    let hyperparameters = hyperparameters(&values);
    let standardization = Standardization::new(&all.basis, &pattern);
    let coefficient_net = LearnedCoefficientNet {
        shape,
        missing: dataset.augmentation_options.missing_policy(),
        center: standardization.means(),
        scale: LOG_SCALE,
        weights: values.coefficient_net,
    };
    let (hyperparameters, precision) =
        hyperparameters.split_at(hyperparameters.len() - all.basis.components());
    let correction = LearnedCorrection {
        rows: RecipeBasis::new(&all.basis, &pattern).basis,
        precision: precision.to_vec(),
    };
    let mut basis = None;
    let target = match refinement {
        None => CompletionTarget::Linear {
            basis_checksum: Basis::checksum(basis.insert(all.basis.to_bytes())),
        },
        Some(refinement) => {
            let refinement = refinement.learned(
                values.initial,
                hyperparameters.to_vec(),
                &all.virtual_readings,
            );
            CompletionTarget::Refinement(refinement, values.init_net)
        }
    };
    Ok(LearnedRecipe {
        pattern,
        fit: LearnedFit::Completed(coefficient_net, correction, target),
        loss_predictor: LossPredictor::new(&held_out_losses, FOLDS).map(|predictor| {
            let counts = options.source_shares.iter().map(|each| each.materials);
            predictor.with_sources(&held_out_losses, &counts.collect::<Vec<_>>())
        }),
        basis,
        expected_loss,
        materials: identities,
    })
}

/// Returns the number of components of the correction, K.
fn corrected_components(options: &Options) -> usize {
    match options.model == ModelKind::Linear && options.samples > MAX_DEVICE_SAMPLES {
        true => MAX_CORRECTED_COMPONENTS,
        false => COMPONENTS,
    }
}

/// The ratio of the losses of two recipes: the full run, and the shorter runs of folds. The losses are summed over
/// materials that both runs train on. Held-out losses are multiplied by this ratio.
#[derive(Default)]
struct FoldCorrection {
    full_sum: f32,
    fold_sum: f32,
}

impl FoldCorrection {
    fn add(&mut self, full_losses: impl Iterator<Item = f32>, fold_losses: Vec<f32>) {
        self.full_sum += full_losses.sum::<f32>();
        self.fold_sum += fold_losses.iter().sum::<f32>();
    }

    fn ratio(&self) -> f32 {
        match self.fold_sum > 0.0 {
            true => self.full_sum / self.fold_sum,
            false => 1.0,
        }
    }
}

/// The factors between the evidence of the full run and that of a fold's shorter run: means of logarithms over materials
/// that both runs train on. The evidence of held-out materials is multiplied by them.
struct EvidenceCorrection(Evidence);

impl EvidenceCorrection {
    fn new(full: &[Evidence], fold: &[Evidence]) -> Self {
        let mean = |list: &[Evidence], value: fn(&Evidence) -> f32| {
            let sum: f32 = list.iter().map(value).sum();
            sum / list.len().max(1) as f32
        };
        let factor = |value| (mean(full, value) - mean(fold, value)).exp();
        Self(Evidence {
            innovation: factor(Evidence::log_innovation),
            residual: factor(Evidence::log_residual),
        })
    }

    fn correct(&self, evidence: Evidence) -> Evidence {
        Evidence {
            innovation: evidence.innovation * self.0.innovation,
            residual: evidence.residual * self.0.residual,
        }
    }
}

/// Draws augmented, rough tasks of a fold's materials and procedural classes, in equal shares.
fn rough_tasks(
    dataset: &Dataset,
    held_out: [&[usize]; 2],
    index: usize,
    options: &Options,
) -> Vec<Task> {
    let groups: Vec<&[usize]> = held_out
        .into_iter()
        .filter(|each| !each.is_empty())
        .collect();
    let groups: Vec<MaterialGroup> = groups
        .iter()
        .map(|materials| MaterialGroup {
            materials: materials.to_vec(),
            share: 1.0 / groups.len() as f32,
        })
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    random.set_stream(u64::MAX - 1 - index as u64);
    let sizes = [options.samples, ROUGH_OUTER_SAMPLES];
    let draw = |_| {
        let (pool, augmentation_options) = (&dataset.pool, &dataset.augmentation_options);
        Task::random(
            pool,
            &groups,
            augmentation_options,
            sizes,
            Dropout::TailOrFew,
            &mut random,
        )
        .with_roughness(&mut random)
    };
    (0..ROUGH_TASKS).map(draw).collect()
}

/// Returns the mean held-out loss of plain materials, or the loss on all training materials without folds.
fn validated_loss(training_loss: LossEstimate, held_out_losses: &[HeldOutLoss]) -> ValidatedLoss {
    let plain = held_out_losses
        .iter()
        .filter(|each| each.origin == HeldOutOrigin::Material);
    let losses: Vec<f64> = plain.map(|each| f64::from(each.loss)).collect();
    if losses.is_empty() {
        return ValidatedLoss {
            estimate: training_loss,
            split: ValidationSplit::Training,
        };
    }
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    ValidatedLoss {
        estimate: LossEstimate::new(mean as f32, losses.iter().copied()),
        split: ValidationSplit::Folds,
    }
}

/// Returns the dataset of `materials` and of procedural materials.
fn dataset(mut materials: Vec<Box<dyn Material>>, options: &Options) -> Dataset {
    let completion_options = &options.completion_options;
    let training_count = materials.len();
    let sources = match &options.source_shares[..] {
        [] => vec![(training_count, 1.0)],
        source_shares => source_shares
            .iter()
            .map(|each| (each.materials, each.share))
            .collect(),
    };
    let mut groups = Vec::new();
    let mut classes = Vec::new();
    let mut first = 0;
    for (materials, share) in sources {
        groups.push(MaterialGroup {
            materials: (first..first + materials).collect(),
            share: share * (1.0 - completion_options.procedural),
        });
        first += materials;
    }
    if completion_options.procedural > 0.0 {
        let (count, seed) = CompletionOptions::PROCEDURAL_SET;
        let set = Procedural::set(count, seed);
        classes.extend(set.iter().map(Procedural::class_index));
        let set = set.into_iter();
        materials.extend(set.map(|each| Box::new(each) as Box<dyn Material>));
        groups.push(MaterialGroup {
            materials: (training_count..materials.len()).collect(),
            share: completion_options.procedural,
        });
    }
    let augmentation_options = AugmentationOptions {
        missing_share: completion_options.missing,
        noise: completion_options.noise(),
        ..AugmentationOptions::default()
    };
    let size = pool_size(training_count, augmentation_options.warps.len());
    let mut dataset = Dataset::new(
        materials,
        training_count,
        groups,
        augmentation_options,
        size,
        options.seed,
    );
    dataset.classes = classes;
    dataset
}

/// Returns the number of directions of the training and the validation pool. It is halved until the values of both
/// pools, with all warps, fit into [`MAX_POOL_BYTES`].
fn pool_size(materials: usize, warps: usize) -> usize {
    const MIN_SIZE: usize = 512;
    let mut size = MAX_POOL_SIZE;
    while size > MIN_SIZE && materials * (warps + 1) * size * size_of::<[f32; 3]>() > MAX_POOL_BYTES
    {
        size /= 2;
    }
    size
}

/// Returns the materials of each fold. The list is empty for too few materials.
fn folds(materials: usize, seed: u64) -> Vec<Vec<usize>> {
    if materials < MIN_MATERIALS_FOR_FOLDS {
        return Vec::new();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    let mut order: Vec<usize> = (0..materials).collect();
    order.shuffle(&mut random);
    let fold = |first| order.iter().copied().skip(first).step_by(FOLDS).collect();
    (0..FOLDS).map(fold).collect()
}

/// Several runs that are reported to the observer as one run.
struct Session<'s, 'o> {
    options: &'s Options,
    identity: RunIdentity,
    refinement: Option<&'s dyn Refinement>,
    dataset: &'s Dataset,
    /// The number of outer steps of all runs.
    total: usize,
    /// The number of completed outer steps.
    done: usize,
    observer: &'s mut Observer<'o>,
}

impl<'s> Session<'s, '_> {
    fn run<'a>(
        &mut self,
        subset: &'a Subset,
        plan: &Plan,
        earlier: Option<&'a Groups<Vec<f32>>>,
        stage: usize,
    ) -> Result<(CompletionObjective<'a>, Outcome), RunError>
    where
        's: 'a,
    {
        let seed = self.options.seed;
        let parameters = self
            .refinement
            .map_or(0, |refinement| refinement.model().parameters().unwrap_or(0));
        let objective = CompletionObjective {
            dataset: self.dataset,
            subset,
            shape: Shape {
                samples: self.options.samples,
                components: COMPONENTS.min(subset.basis.components()),
                hidden: HIDDEN_UNITS,
                units: if parameters > 0 { INIT_NET_UNITS } else { 0 },
                parameters,
            },
            loss_weights: plan.loss_weights,
            streams: RandomStreams { seed },
            refinement: self.refinement,
            auxiliary_weight: AUXILIARY_WEIGHT,
            limits: self.options.completion_options.limits,
            earlier,
        };
        let outer_loop = OuterLoop {
            objective: &objective,
            plan,
            identity: self.identity,
            seed,
            checkpoints: self.options.checkpoints.clone(),
            stage,
        };
        let (done_before, total) = (self.done, self.total);
        let observer = &mut *self.observer;
        let mut combined = |progress: &Progress| -> ControlFlow<()> {
            observer(&Progress {
                done: done_before + progress.done,
                total,
                ..*progress
            })
        };
        let outcome = match outer_loop.run(&mut combined) {
            Err(RunError::Stopped(done)) => Err(RunError::Stopped(done_before + done)),
            outcome => outcome,
        }?;
        self.done += plan.steps();
        Ok((objective, outcome))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pool_shrinks_for_thousands_of_materials() {
        let sizes = [1, 100, 4_096, 4_097, 10_000, 1_000_000].map(|count| pool_size(count, 7));
        assert_eq!(sizes, [8_192, 8_192, 8_192, 4_096, 2_048, 512]);
    }
}
