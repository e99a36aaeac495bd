//! Training with schedule prior: one run on all materials, then one run per fold to estimate the expected loss.

use std::ops::ControlFlow;

use glimpse_core::fit::Ridge;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Contents;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::identity::RunIdentity;
use glimpse_fitting::recipe::options::{Effort, TrainingOptions};
use glimpse_fitting::recipe::sections::Arena;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material};

use super::dataset::{Dataset, Subset};
use super::folds::{FOLDS, Fold, folds};
use super::held_out::{HeldOut, TrainedFold};
use super::hyperparameters::Hyperparameters;
use super::objective::{COMPONENTS, PriorObjective};
use super::phases;
use crate::learned::Learned;
use crate::loss_predictor::{HeldOutLoss, LossPredictor};
use crate::outer::{Checkpoints, Observer, OuterLoop, PathOfSamples, Progress, RunError};
use crate::phase::{Phase, Values};
use crate::tasks::reading::LOG_SCALE;

/// The number of components of the correction, K, for the model Linear with more samples than a device fits.
const MAX_CORRECTED_COMPONENTS: usize = 120;
/// The largest number of samples with [`COMPONENTS`] in the correction.
const MAX_DEVICE_SAMPLES: usize = 64;

/// Trains a recipe on all materials. Then trains once per fold on the materials outside the fold, to estimate the loss
/// on unseen materials.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub(super) fn train<'a>(
    arena: &'a Arena,
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: Option<&Checkpoints>,
    observer: &mut Observer<'_>,
) -> Result<Learned<'a>, RunError> {
    let identities = Identity::list(&materials);
    let identity = options.identity(&identities);
    let dataset = Dataset::of(materials, options);
    let folds = folds(dataset.training_count, &options.source_shares, options.seed);
    let [steps, fold_steps] = phases::step_counts(options.effort, options.model);
    let mut session = Session {
        options,
        checkpoints,
        identity,
        total: steps + folds.len() * fold_steps,
        done: 0,
        observer,
    };

    let components = corrected_components(options);
    let all = Subset::all(&dataset, components);
    let objective = PriorObjective::new(&all, options);
    let values = session.run(&objective, phases::phases, 0)?;
    let expected_loss = objective.expected_loss(&values);
    let mut held_out = HeldOut::new(&dataset, options);
    for (index, Fold { materials, origin }) in folds.iter().enumerate() {
        // The classes of procedural materials that are left out with the fold.
        let classes: Vec<usize> = (dataset.training_count..dataset.materials.len())
            .filter(|each| dataset.classes[each - dataset.training_count] % FOLDS == index)
            .collect();
        let subset = Subset::without(&dataset, components, &[&materials[..], &classes].concat());
        let fold_objective = PriorObjective {
            earlier: Some(&values),
            ..PriorObjective::new(&subset, options)
        };
        let fold_values = session.run(&fold_objective, phases::fold, index + 1)?;
        held_out.add(&TrainedFold {
            index,
            full: (&objective, &values),
            fold: (&fold_objective, &fold_values),
            materials,
            origin: *origin,
            classes: &classes,
        });
    }
    let held_out = held_out.finish();
    let expected_loss = validated_loss(expected_loss, &held_out.complete);
    let pattern = objective.reachable_pattern(&values).angles().to_vec();
    let hyperparameters = Hyperparameters::decode(&values.hyperparameters, all.basis.components());
    let refinement = objective.sections(arena, &values);
    let basis = refinement.is_none().then(|| all.basis.to_bytes());
    let checksum = basis.as_deref().map_or(0, Basis::checksum);
    let at = ComponentsAt::new(&all.basis, pattern.clone());
    Ok(Learned {
        pattern,
        fit: Contents {
            ridge: Some(Ridge {
                rows: arena.rows(&at),
                ..arena.ridge(&at, &hyperparameters.precision, checksum)
            }),
            net: Some(arena.net(
                objective.shape,
                &values.coefficient_net,
                dataset.reading_options.tolerates_missing(),
                LOG_SCALE,
            )),
            start: refinement.map(|(start, _)| start),
            gauss_newton: refinement.map(|(_, steps)| steps),
            ..Contents::default()
        },
        loss_predictor: LossPredictor::new(&held_out.complete, FOLDS).map(|predictor| {
            let counts = options.source_shares.iter().map(|each| each.materials);
            predictor
                .with_sources(&held_out.complete, &counts.collect::<Vec<_>>())
                .with_partial(&held_out.partial, options.samples)
        }),
        basis,
        expected_loss: Some(expected_loss),
        materials: identities,
    })
}

/// Returns the number of components of the correction, K.
fn corrected_components(options: &TrainingOptions) -> usize {
    if options.model == ModelKind::Linear && options.samples > MAX_DEVICE_SAMPLES {
        MAX_CORRECTED_COMPONENTS
    } else {
        COMPONENTS
    }
}

/// Returns the mean held-out loss of plain materials, or the loss on all training materials without folds.
fn validated_loss(training_loss: LossEstimate, held_out_losses: &[HeldOutLoss]) -> ValidatedLoss {
    let plain = held_out_losses
        .iter()
        .filter(|each| each.origin.is_training_material());
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

/// Several runs that are reported to the observer as one run.
struct Session<'s, 'o> {
    options: &'s TrainingOptions,
    checkpoints: Option<&'s Checkpoints>,
    identity: RunIdentity,
    /// The number of outer steps of all runs.
    total: usize,
    /// The number of completed outer steps.
    done: usize,
    observer: &'s mut Observer<'o>,
}

impl Session<'_, '_> {
    fn run<'a>(
        &mut self,
        objective: &'a PriorObjective<'a>,
        phases: fn(&'a PriorObjective<'a>, Effort) -> Vec<Phase<'a>>,
        stage: usize,
    ) -> Result<Values, RunError> {
        let phases = phases(objective, self.options.effort);
        let permute = |values, order: &[usize]| objective.permute_samples(values, order);
        let outer_loop = OuterLoop {
            initial: objective.initial_values(0),
            phases: &phases,
            path: objective.motion.as_ref().map(|motion| PathOfSamples {
                motion,
                permute: &permute,
            }),
            identity: self.identity,
            checkpoints: self.checkpoints,
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
        let values = match outer_loop.run(&mut combined) {
            Err(RunError::Stopped(done)) => Err(RunError::Stopped(done_before + done)),
            result => result,
        }?;
        self.done += phases.iter().map(|phase| phase.steps).sum::<usize>();
        Ok(values)
    }
}
