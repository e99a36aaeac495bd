//! Schedule prior: its gradient against differences of its loss, the same bits on any number of
//! threads, and a recipe that fits as what was trained does.

use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::time::Duration;

use glimpse_core::fit::coefficient_net::standardized;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::Limits;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::Noise;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape};
use glimpse_kernels::scan::scan;
use glimpse_materials::{Material, Procedural};
use glimpse_optimizer::Groups;
use glimpse_training::meta::completion::dataset::{Dataset, Subset};
use glimpse_training::meta::completion::objective::CompletionObjective;
use glimpse_training::meta::completion::refinement::{Refinement, SgdRefinement};
use glimpse_training::meta::completion::task::{AugmentationOptions, MaterialGroup};
use glimpse_training::meta::learned::LearnedFit;
use glimpse_training::meta::objective::{MetaObjective, RandomStreams};
use glimpse_training::meta::options::{CompletionOptions, Options};
use glimpse_training::meta::outer::{CheckpointOptions, OuterLoop, RunError};
use glimpse_training::meta::pattern::Pattern;
use glimpse_training::meta::phase::{Initialization, OuterStep};
use glimpse_training::meta::plan::{Effort, LossWeights, Plan, Schedule};
use glimpse_training::meta::run::{TrainError, train};
use glimpse_training::recipe::pack_recipe;

use crate::support::{assert_independent_of_threads, procedural, run_bits};

const SAMPLES: usize = 5;
const STEPS: usize = 4;
/// The pattern's place among the groups.
const PATTERN: usize = 2;
const MODELS: [ModelKind; 4] = [
    ModelKind::Linear,
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
];

/// Calls a function with a small objective of a model, and a plan of a few steps.
fn with_objective<T>(model: ModelKind, of: impl FnOnce(&CompletionObjective<'_>, &Plan) -> T) -> T {
    let augmentation_options = AugmentationOptions {
        missing: 0.5,
        noise: Noise {
            multiplicative: 0.02,
            additive: 0.001,
            // The derivative does not see a sensor's steps.
            levels: 0,
        },
        ..AugmentationOptions::default()
    };
    let group = |materials: Range<usize>, share| MaterialGroup {
        materials: materials.collect(),
        share,
    };
    let groups = vec![group(0..8, 0.7), group(8..12, 0.3)];
    let dataset = Dataset::new(procedural(12, 3), 8, groups, augmentation_options, 512, 5);
    let subset = Subset::all(&dataset, 6);
    let (phong, cook_torrance) = (
        SgdRefinement::<Phong>::new(2),
        SgdRefinement::<CookTorrance>::new(2),
    );
    let neural = SgdRefinement::<Neural>::new(2);
    let refinement: Option<&dyn Refinement> = match model {
        ModelKind::Phong => Some(&phong),
        ModelKind::CookTorrance => Some(&cook_torrance),
        ModelKind::Neural => Some(&neural),
        _ => None,
    };
    let mut plan = Plan::new(Schedule::Prior, Effort::Quick, model, SAMPLES, 12);
    for phase in &mut plan.phases {
        (phase.steps, phase.batch, phase.outer_samples) = (STEPS, 40, 512);
    }
    let objective = CompletionObjective {
        dataset: &dataset,
        subset: &subset,
        shape: Shape {
            samples: SAMPLES,
            components: subset.basis.components(),
            hidden: 7,
            units: if refinement.is_some() { 5 } else { 0 },
            parameters: model.parameters().unwrap_or(0),
        },
        loss_weights: LossWeights::Relative,
        streams: RandomStreams { seed: 11 },
        refinement,
        initial_step_size: plan.initial_step_size,
        auxiliary_weight: 0.0,
        limits: Limits {
            max_theta_i: 1.4,
            min_separation: 0.2,
            ..Limits::NONE
        },
        pattern: None,
    };
    of(&objective, &plan)
}

/// Brings all samples nearer to the normal: where the arms get to.
fn raise(values: &mut Groups<Vec<f32>>) {
    for logits in values.pattern.chunks_mut(3) {
        logits[0] -= 1.0;
        logits[1] -= 1.0;
    }
}

/// Along the gradient of each group by itself, the loss changes as fast as the gradient is long.
fn gradient_is_that_of_the_loss(model: ModelKind) {
    with_objective(model, |objective, plan| {
        let phase_index = plan.phases.len() - 1;
        let at = OuterStep {
            phase: &plan.phases[phase_index],
            phase_index,
            step: 1,
        };
        let mut values = objective.initial_values(0);
        // A start that hears of the readings: steps by themselves jump where a sample changes sides.
        values.init_net.iter_mut().for_each(|weight| *weight *= 5.0);
        // All samples where the arms get to: the barrier is in the gradient and not in the loss.
        raise(&mut values);
        let pattern = Pattern::from_logits_within(&values.pattern, objective.limits);
        assert!(pattern.valid().iter().all(|valid| *valid));
        let mut compared = 0;
        for group in [0, 1, 3, 4, PATTERN] {
            // With a place, a descent's steps jump: where a sample changes sides. That is what they are
            // short for here; `pattern.rs` holds their own derivative by places against differences.
            if group == PATTERN {
                values.hyperparameters.fill(-30.0);
            }
            let (loss, gradient) = objective.gradient(&values, at);
            assert!(loss > 0.0 && loss.is_finite());
            let along = gradient.each()[group].clone();
            let square: f64 = along.iter().map(|by| f64::from(*by).powi(2)).sum();
            if square == 0.0 {
                continue;
            }
            // So far that the loss changes by a few thousandths of itself, but no value by much.
            let largest = along.iter().fold(0.0_f32, |most, by| most.max(by.abs()));
            let step = (2e-3 * f64::from(loss) / square).min(0.004 / f64::from(largest));
            let moved = |sign: f64| {
                let mut values: Groups<Vec<f32>> = values.clone();
                let list = values.each_mut().into_iter().nth(group);
                for (value, by) in list.into_iter().flatten().zip(&along) {
                    *value += (sign * step * f64::from(*by)) as f32;
                }
                f64::from(objective.gradient(&values, at).0)
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let error = (slope - square).abs() / square;
            println!("{model}, group {group}: {slope:.4e} and {square:.4e}");
            assert!(error < 0.03, "{model}, group {group}: {slope} and {square}");
            compared += 1;
        }
        let expected = if model == ModelKind::Linear { 2 } else { 5 };
        assert_eq!(compared, expected, "groups of {model}");
    });
}

#[test]
fn linear_s_gradient_is_that_of_the_loss() {
    gradient_is_that_of_the_loss(ModelKind::Linear);
}

#[test]
fn phong_s_gradient_is_that_of_the_loss() {
    gradient_is_that_of_the_loss(ModelKind::Phong);
}

#[test]
fn cook_torrance_s_gradient_is_that_of_the_loss() {
    gradient_is_that_of_the_loss(ModelKind::CookTorrance);
}

#[test]
fn neural_s_gradient_is_that_of_the_loss() {
    gradient_is_that_of_the_loss(ModelKind::Neural);
}

/// Samples change places, and what each of them says of a material goes with them.
#[test]
fn samples_in_order_say_together_what_they_said_before() {
    with_objective(ModelKind::Linear, |objective, _| {
        let mut values = objective.initial_values(0);
        raise(&mut values);
        let ordered = objective.reorder_samples(values.clone());
        assert_ne!(ordered.pattern, values.pattern);
        let places = |values: &Groups<Vec<f32>>| {
            let mut places: Vec<[u32; 3]> = values
                .pattern
                .as_chunks()
                .0
                .iter()
                .map(|logits: &[f32; 3]| logits.map(f32::to_bits))
                .collect();
            places.sort_unstable();
            places
        };
        assert_eq!(places(&ordered), places(&values));
        let (before, after) = (
            objective.validation_loss(&values),
            objective.validation_loss(&ordered),
        );
        assert!((after / before - 1.0).abs() < 1e-4, "{before} and {after}");
        // What comes first is what tells most by itself, and once in order they stay so.
        assert_eq!(objective.reorder_samples(ordered.clone()), ordered);
    });
}

/// A run that is saved in a directory, if one is given.
fn run<'a>(
    objective: &'a CompletionObjective<'_>,
    plan: &'a Plan,
    model: ModelKind,
    directory: Option<&Path>,
) -> OuterLoop<'a> {
    let options = Options::new(model, SAMPLES, Schedule::Prior, Effort::Brief, 11);
    OuterLoop {
        objective,
        plan,
        identity: options.identity(&[]),
        seed: 11,
        checkpoints: directory.map(checkpoints),
        stage: 0,
    }
}

/// Checkpoints that are written where a run is stopped only.
fn checkpoints(directory: &Path) -> CheckpointOptions {
    CheckpointOptions {
        directory: directory.to_owned(),
        interval: Duration::from_secs(3600),
        resume: true,
    }
}

#[test]
fn every_model_trains_the_same_on_any_number_of_threads() {
    for model in MODELS {
        let bits = assert_independent_of_threads(model.name(), || {
            with_objective(model, |objective, plan| {
                let run = run(objective, plan, model, None);
                run_bits(&run)
            })
        });
        assert!(bits.len() > 100 && bits.iter().all(|bits| f32::from_bits(*bits).is_finite()));
    }
}

/// Stopped in its last phase and resumed, a run comes to the same numbers.
#[test]
fn a_resumed_run_comes_to_the_same_numbers() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let options = |checkpoints| Options {
        completion_options: CompletionOptions {
            missing: 0.5,
            noise: 0.02,
            procedural: 0.0,
            ..CompletionOptions::default()
        },
        checkpoints,
        ..Options::new(ModelKind::Phong, 2, Schedule::Prior, Effort::Brief, 3)
    };
    let go_on = &mut |_: &_| ControlFlow::Continue(());
    let whole = train(&options(None), procedural(10, 3), go_on).expect("it is trained");
    let options = options(Some(checkpoints(&scratch.path().join("checkpoint"))));
    let stopped = train(
        &options,
        procedural(10, 3),
        &mut |progress| match 4 * progress.done > 3 * progress.total {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        },
    );
    assert!(matches!(stopped, Err(TrainError::Stopped(_))));
    let resumed = train(&options, procedural(10, 3), go_on);
    assert_eq!(resumed.expect("it is trained"), whole);
}

/// Stopped where patterns were tried and samples are about to be put in order, or just after that.
#[test]
fn a_run_resumed_where_samples_are_put_in_order_comes_to_the_same_numbers() {
    with_objective(ModelKind::Linear, |objective, plan| {
        let tried = plan.phases.len() - 1;
        assert!(
            plan.phases[tried].initialization == Initialization::BestReordered
                && plan.phases[tried].samples_ordered
        );
        let run = |directory: Option<&Path>, until| {
            let run = run(objective, plan, ModelKind::Linear, directory);
            run.run(&mut |progress| match progress.done == until {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            })
        };
        let whole = run(None, usize::MAX).expect("nothing stops it");
        for until in [tried * STEPS, tried * STEPS + 1] {
            let scratch = tempfile::tempdir().expect("a temporary directory");
            let stopped = run(Some(scratch.path()), until);
            assert!(matches!(stopped, Err(RunError::Stopped(done)) if done == until));
            let resumed = run(Some(scratch.path()), usize::MAX).expect("nothing stops it");
            assert_eq!(resumed.values, whole.values, "stopped after {until} steps");
        }
    });
}

/// What bytes cost: a recipe's coefficients are those of the weights that were trained, but for a
/// hundredth.
#[test]
fn a_recipe_completes_as_what_was_trained() {
    let model = ModelKind::Linear;
    let options = Options::new(model, SAMPLES, Schedule::Prior, Effort::Brief, 1);
    let learned = train(&options, procedural(12, 3), &mut |_| {
        ControlFlow::Continue(())
    });
    let learned = learned.expect("it is trained");
    let file = pack_recipe(&learned, &options, "procedural:12:3");
    let file = file.expect("it is a recipe");
    let recipe = file.recipe();
    let LearnedFit::Completed(completion, _) = &learned.fit else {
        panic!("{learned:?}");
    };
    let (mut error, mut size) = (0.0, 0.0);
    for material in Procedural::set(6, 77) {
        let found = scan(&recipe, &mut |angles| material.brdf(angles)).expect("it is fitted");
        let mut batch = Batch::new(completion.shape, 1);
        for (sample, (angles, center)) in learned.pattern.iter().zip(&completion.center).enumerate()
        {
            let at = HalfDifference::from_angles(*angles);
            let weight = at.cos_theta_i() * at.cos_theta_o();
            let reading = material.brdf(*angles);
            let reading = reading.map(|y| standardized(y, weight, *center, completion.scale));
            batch.set(0, sample, Some(reading));
        }
        batch.complete(&CompletionWeights {
            shape: completion.shape,
            coefficient_net: &completion.weights,
            init_net: &[],
        });
        let expected = batch.coefficients(0);
        assert_eq!(found.values.len(), expected.len());
        for (found, expected) in found.values.iter().zip(expected) {
            error += f64::from(found - expected).powi(2);
            size += f64::from(expected).powi(2);
        }
    }
    let error = (error / size).sqrt();
    println!("bytes move coefficients by {error:.1e}");
    assert!(error > 0.0 && error < 0.01, "{error}");
}
