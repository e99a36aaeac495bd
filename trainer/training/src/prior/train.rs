//! Training with schedule prior: one run on all materials, then one run per fold to estimate the expected loss. The phases
//! of a run train the CoefficientNet with the pattern, and then the StartNet.

use glimpse_core::fit::Ridge;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Contents;
use glimpse_fitting::linear::{ComponentsAt, to_host_bytes};
use glimpse_fitting::recipe::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::options::Effort;
use glimpse_materials::basis::BasisTable;
use glimpse_optimizer::Groups;

use super::cross_validation::{FOLDS, Fold, HeldOut, TrainedFold, folds};
use super::dataset::{Dataset, Subset};
use super::hyperparameters::Hyperparameters;
use super::objective::{COMPONENTS, PriorObjective, RANDOM_TASKS, StepOptions};
use super::steps::Steps;
use crate::job::Job;
use crate::loss_predictor::{HeldOutLoss, LossPredictor};
use crate::outer::{Criterion, Gradient, PathOfSamples, Phase, PhaseStart, Session};
use crate::result::{Learned, TrainError};
use crate::tasks::reading::LOG_SCALE;
use crate::tasks::task::Dropout;

/// The number of components of the correction, K, for the model Linear with more samples than a device fits.
const MAX_CORRECTED_COMPONENTS: usize = 120;
/// The largest number of samples with [`COMPONENTS`] in the correction.
const MAX_DEVICE_SAMPLES: usize = 64;

/// Trains a recipe on all materials. Then trains once per fold on the materials outside the fold, to estimate the loss
/// on unseen materials.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub(crate) fn train<'a>(mut job: Job<'a, '_>) -> Result<Learned<'a>, TrainError> {
    let dataset = Dataset::of(job.materials, job.options);
    let folds = folds(
        dataset.training_count,
        &job.options.source_shares,
        job.options.seed,
    );
    let steps = Steps::of(job.options.effort, job.options.model);
    job.session.total = steps.patterns as usize * steps.search
        + steps.coefficient_net
        + steps.start_net
        + folds.len() * steps.fold.iter().sum::<usize>();

    let components = match job.options.model {
        ModelKind::Linear if job.options.samples > MAX_DEVICE_SAMPLES => MAX_CORRECTED_COMPONENTS,
        _ => COMPONENTS,
    };
    let all = Subset::without(&dataset, components, &[]);
    let objective = PriorObjective::new(&all, job.options);
    let run =
        |session: &mut Session<'_, '_>, objective: &PriorObjective<'_>, phases: &[Phase<'_>]| {
            let permute = |values, order: &[usize]| objective.permute_samples(values, order);
            let path = objective.motion.as_ref().map(|motion| PathOfSamples {
                motion,
                permute: &permute,
            });
            session.run(objective.initial_values(0), phases, path)
        };
    let values = run(
        &mut job.session,
        &objective,
        &phases(&objective, job.options.effort),
    )?;
    let expected_loss = objective.expected_loss(&values);
    let mut held_out = HeldOut::new(&dataset, job.options);
    for (index, Fold { materials, origin }) in folds.iter().enumerate() {
        // The classes of procedural materials that are left out with the fold.
        let classes: Vec<usize> = (dataset.training_count..dataset.materials.len())
            .filter(|each| dataset.classes[each - dataset.training_count] % FOLDS == index)
            .collect();
        let subset = Subset::without(&dataset, components, &[&materials[..], &classes].concat());
        let fold_objective = PriorObjective {
            earlier: Some(&values),
            ..PriorObjective::new(&subset, job.options)
        };
        let fold_phases = fold_phases(&fold_objective, job.options.effort);
        let fold_values = run(&mut job.session, &fold_objective, &fold_phases)?;
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
    let pattern = objective.reach.reachable_angles(&values.pattern);
    let hyperparameters = Hyperparameters::decode(&values.hyperparameters, all.basis.components());
    let refinement = objective.sections(job.arena, &values);
    let basis = refinement.is_none().then_some(&all.basis);
    let checksum = basis.map_or(0, BasisTable::checksum);
    let at = ComponentsAt::new(&all.basis, pattern.clone());
    Ok(Learned {
        pattern,
        fit: Contents {
            ridge: Some(Ridge {
                rows: job.arena.rows(&at),
                ..job.arena.ridge(&at, &hyperparameters.precision, checksum)
            }),
            net: Some(job.arena.net(
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
            let counts = job.options.source_shares.iter().map(|each| each.materials);
            predictor
                .with_sources(&held_out.complete, &counts.collect::<Vec<_>>())
                .with_partial(&held_out.partial, job.options.samples)
        }),
        basis: basis.map(to_host_bytes),
        expected_loss: Some(expected_loss),
    })
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

/// Returns the gradient of a phase.
fn phase_gradient<'a>(
    objective: &'a PriorObjective<'a>,
    dropout: Dropout,
    is_refined: bool,
) -> Gradient<'a> {
    let options = StepOptions {
        outer_samples: objective.outer_samples,
        dropout,
        is_refined,
    };
    Box::new(move |values, step| objective.gradient(values, step, options))
}

/// Returns a phase of the pattern search: one pattern with its own CoefficientNet.
fn pattern_search<'a>(
    objective: &'a PriorObjective<'a>,
    steps: usize,
    start: Option<PhaseStart<'a>>,
) -> Phase<'a> {
    Phase {
        name: "pattern search",
        samples: objective.shape.samples,
        start,
        gradient: phase_gradient(objective, Dropout::Any, false),
        selection: Criterion::BestValidation(Box::new(|values| objective.selection_loss(values))),
        steps,
        batch: 32,
        rates: Groups {
            pattern: 3e-2,
            coefficient_net: 5e-3,
            hyperparameters: 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.1,
        warm_up_steps: 100,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        initial_allowance: 3.0,
    }
}

/// Returns the phase that trains the CoefficientNet without a StartNet. Its samples are sorted for scans that end early.
fn coefficient_net_phase<'a>(
    objective: &'a PriorObjective<'a>,
    steps: usize,
    start: Option<PhaseStart<'a>>,
) -> Phase<'a> {
    Phase {
        name: "coefficient network",
        gradient: phase_gradient(objective, Dropout::TailOrFew, false),
        selection: Criterion::Last,
        final_rate_ratio: 0.01,
        initial_allowance: 1.3,
        ..pattern_search(objective, steps, start)
    }
}

/// Returns the phase that trains the StartNet.
///
/// Neural can represent what the coefficients do, and is worse on other materials than the training set if they change.
/// For the models with few parameters, pattern and coefficients are trained again, for the fit.
fn start_net_phase<'a>(objective: &'a PriorObjective<'a>, steps: usize) -> Phase<'a> {
    let (pattern, coefficient_net_rate) = match objective.model() {
        ModelKind::Neural => (0.0, 0.0),
        _ => (1e-2, 1.5e-3),
    };
    let start = Box::new(|best| objective.choose_initial(best));
    Phase {
        name: "start network",
        gradient: phase_gradient(objective, Dropout::TailOrFew, true),
        rates: Groups {
            initial: 1e-3,
            hyperparameters: 1e-2,
            pattern,
            coefficient_net: coefficient_net_rate,
            start_net: 3e-3,
        },
        ..coefficient_net_phase(objective, steps, Some(start))
    }
}

/// Returns the phases of a training on all materials.
///
/// A search trains several patterns, each with its own CoefficientNet. The best pattern continues, with its samples
/// sorted for scans that end early. Without a search, the samples keep their order. For models other than Linear, a final
/// phase trains the StartNet, which is the only phase for random directions.
#[must_use]
pub fn phases<'a>(objective: &'a PriorObjective<'a>, effort: Effort) -> Vec<Phase<'a>> {
    let steps = Steps::of(effort, objective.model());
    if objective.random_directions.is_some() {
        return vec![Phase {
            start: None,
            gradient: Box::new(|values, step| objective.gradient(values, step, RANDOM_TASKS)),
            ..start_net_phase(objective, steps.random_start_net)
        }];
    }
    let search = (0..steps.patterns).map(|guess| {
        let start: PhaseStart<'a> = Box::new(move |_| objective.initial_values(guess));
        pattern_search(objective, steps.search, Some(start))
    });
    let mut phases: Vec<Phase<'a>> = search.collect();
    let reorder = || -> PhaseStart<'a> { Box::new(|best| objective.reorder_samples(best)) };
    let start = (!phases.is_empty()).then(reorder);
    phases.push(coefficient_net_phase(
        objective,
        steps.coefficient_net,
        start,
    ));
    if steps.start_net > 0 {
        phases.push(start_net_phase(objective, steps.start_net));
    }
    phases
}

/// Returns the phases of a cross-validation fold, at a fixed pattern. The resulting losses on the fold's materials, which
/// the run does not train on, estimate the loss on unseen materials.
#[must_use]
pub fn fold_phases<'a>(objective: &'a PriorObjective<'a>, effort: Effort) -> Vec<Phase<'a>> {
    let [coefficient_net_steps, start_net_steps] = Steps::of(effort, objective.model()).fold;
    let mut phases = vec![coefficient_net_phase(
        objective,
        coefficient_net_steps,
        None,
    )];
    if start_net_steps > 0 {
        phases.push(start_net_phase(objective, start_net_steps));
    }
    for phase in &mut phases {
        phase.name = "cross-validation";
        phase.rates.pattern = 0.0;
    }
    phases
}
