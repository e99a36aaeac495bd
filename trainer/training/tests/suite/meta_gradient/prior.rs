//! Tests of the schedule `prior`: gradients match differences of the loss, results are identical on any number of
//! threads, and packed recipes fit like the trained nets.

use std::f32::consts::PI;
use std::ops::{ControlFlow, Range};
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::model::linear::map;
use glimpse_core::numeric::Rows;

use glimpse_fitting::recipe::ReadingNoise;
use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_kernels::ModelKernels;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape, complete};
use glimpse_kernels::scan::scan_with_missing;
use glimpse_materials::{Brdf, MODELS, Procedural};
use glimpse_training::outer::{Checkpoints, MetaValues, OuterStep, Phase, Session, StepObserver};
use glimpse_training::pattern::Reach;
use glimpse_training::prior::dataset::{Dataset, Subset};
use glimpse_training::prior::objective::{PriorObjective, StepOptions};
use glimpse_training::prior::train::phases;
use glimpse_training::run::{TrainError, train};
use glimpse_training::streams::RandomStreams;
use glimpse_training::tasks::task::{Dropout, MaterialGroup, ReadingOptions};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::support::{
    assert_gradient_matches_loss, assert_independent_of_threads, procedural, run_bits,
};

const SAMPLES: usize = 5;
const STEPS: usize = 4;

/// Calls a function with a small objective.
fn with_objective<T>(model: ModelKind, function: impl FnOnce(&PriorObjective<'_>) -> T) -> T {
    let limits = Limits {
        max_theta_i: 1.4,
        min_separation: 0.2,
        ..Limits::NONE
    };
    with_reach(model, Reach { limits, fixed: &[] }, function)
}

/// Calls a function with a small objective of patterns within a reach.
fn with_reach<T>(
    model: ModelKind,
    reach: Reach<'_>,
    function: impl FnOnce(&PriorObjective<'_>) -> T,
) -> T {
    let reading_options = ReadingOptions {
        missing_share: 0.5,
        noise: ReadingNoise {
            multiplicative: 0.02,
            additive: 0.001,
            // Quantization of a sensor has no derivative.
            levels: 0,
        },
    };
    let group = |materials: Range<usize>, share| MaterialGroup {
        materials: materials.collect(),
        share,
    };
    let groups = vec![group(0..8, 0.7), group(8..12, 0.3)];
    let dataset = Dataset::new(procedural(12, 3), 8, groups, reading_options, 512, 5);
    let subset = Subset::without(&dataset, 6, &[]);
    let refinement = ModelKernels::of(model);
    let objective = PriorObjective {
        subset: &subset,
        shape: Shape {
            samples: SAMPLES,
            components: subset.basis.components(),
            hidden: 7,
            units: if refinement.is_some() { 5 } else { 0 },
            parameters: model.parameters().unwrap_or(0),
        },
        outer_samples: 128,
        streams: RandomStreams { seed: 11 },
        refinement,
        auxiliary_weight: 0.0,
        reach,
        motion: None,
        random_directions: None,
        earlier: None,
    };
    function(&objective)
}

/// Moves all samples closer to the normal, within the limits of the arms.
fn move_toward_normal(values: &mut MetaValues) {
    for logits in values.pattern.chunks_mut(3) {
        logits[0] -= 1.0;
        logits[1] -= 1.0;
    }
}

/// Returns the phases of the schedule, each of a few steps.
fn short_phases<'a>(objective: &'a PriorObjective<'a>) -> Vec<Phase<'a>> {
    let mut phases = phases(objective, Effort::Quick);
    for phase in &mut phases {
        (phase.steps, phase.batch) = (STEPS, 40);
    }
    phases
}

#[test]
fn gradient_matches_loss() {
    for model in MODELS {
        with_objective(model, |objective| {
            let mut values = objective.initial_values(0);
            // Gradient steps are discontinuous where a residual changes sign. With larger weights, the start net
            // dominates the fit, and its output is a smooth function of the readings.
            values
                .start_net
                .iter_mut()
                .for_each(|weight| *weight *= 5.0);
            // All samples are within the limits: the barrier contributes to the gradient but not to the loss.
            move_toward_normal(&mut values);
            let pattern = objective.reach.pattern(&values.pattern);
            assert!(pattern.valid.iter().all(|valid| *valid));
            let groups = assert_gradient_matches_loss(model.name(), &values, |values| {
                objective.gradient(values, OUTER_STEP, OPTIONS)
            });
            let expected = if model == ModelKind::Linear { 3 } else { 5 };
            assert_eq!(groups, expected, "groups of {model}");
        });
    }
}

const OUTER_STEP: OuterStep = OuterStep {
    phase_index: 3,
    step: 1,
    batch: 40,
};
const OPTIONS: StepOptions = StepOptions {
    outer_samples: 512,
    dropout: Dropout::TailOrFew,
    is_refined: true,
};

/// Fixed directions have no gradient and keep their place, and in one plane azimuths have none.
#[test]
fn fixed_directions_and_planes_are_kept() {
    let fixed = [0.2, 0.7].map(|theta_d| Angles::from_array([0.3, theta_d, PI]));
    let limits = Limits {
        in_plane: true,
        ..Limits::NONE
    };
    let reach = Reach {
        limits,
        fixed: &fixed,
    };
    with_reach(ModelKind::Linear, reach, |objective| {
        let mut values = objective.initial_values(0);
        move_toward_normal(&mut values);
        let (_, gradient) = objective.gradient(&values, OUTER_STEP, OPTIONS);
        let (by_sample, _) = gradient.pattern.as_chunks::<3>();
        assert_eq!(by_sample[..2], [[0.0; 3]; 2]);
        for by_logits in &by_sample[2..] {
            assert!(by_logits[0] != 0.0 && by_logits[1] != 0.0 && by_logits[2] == 0.0);
        }
        assert_gradient_matches_loss("in one plane", &values, |values| {
            objective.gradient(values, OUTER_STEP, OPTIONS)
        });
        let ordered = objective.reorder_samples(values.clone());
        assert_ne!(ordered.pattern, values.pattern);
        for values in [&values, &ordered] {
            let reachable = reach.reachable_angles(&values.pattern);
            assert_eq!(reachable[..2], fixed);
            for angles in reachable {
                let directions = HalfDifference::from_angles(angles).directions();
                assert_eq!(limits.check(&directions), Ok(()), "{angles:?}");
            }
        }
    });
}

/// The weights of samples are permuted together with their directions.
#[test]
fn reordering_samples_preserves_the_loss() {
    with_objective(ModelKind::Linear, |objective| {
        let mut values = objective.initial_values(0);
        move_toward_normal(&mut values);
        let ordered = objective.reorder_samples(values.clone());
        assert_ne!(ordered.pattern, values.pattern);
        let sorted_samples = |values: &MetaValues| {
            let mut samples = values.pattern.as_chunks::<3>().0.to_vec();
            samples.sort_by(|one, other| one[0].total_cmp(&other[0]));
            samples
        };
        assert_eq!(sorted_samples(&ordered), sorted_samples(&values));
        let (before, after) = (
            objective.selection_loss(&values),
            objective.selection_loss(&ordered),
        );
        assert!((after / before - 1.0).abs() < 1e-4, "{before} and {after}");
        // Reordering is idempotent.
        assert_eq!(objective.reorder_samples(ordered.clone()), ordered);
    });
}

/// Runs phases.
fn run_phases(
    objective: &PriorObjective<'_>,
    phases: &[Phase<'_>],
    checkpoints: Option<&Checkpoints>,
    observer: &mut StepObserver<'_>,
) -> Result<MetaValues, TrainError> {
    let options = TrainingOptions::new(
        objective.model(),
        SAMPLES,
        Schedule::Prior,
        Effort::Brief,
        11,
    );
    let mut session = Session::new(options.identity(&[]), checkpoints, observer);
    session.run(objective.initial_values(0), phases, None)
}

fn checkpoints(directory: &Path) -> Checkpoints {
    Checkpoints {
        directory: directory.to_owned(),
        resume: true,
    }
}

#[test]
fn training_is_independent_of_threads() {
    for model in MODELS {
        let bits = assert_independent_of_threads(model.name(), || {
            with_objective(model, |objective| {
                run_bits(|observer| run_phases(objective, &short_phases(objective), None, observer))
            })
        });
        assert!(bits.len() > 100 && bits.iter().all(|bits| f32::from_bits(*bits).is_finite()));
    }
}

/// The run is stopped before the phase that reorders samples, or after its first step.
#[test]
fn run_resumed_at_sample_reordering_matches_uninterrupted_run() {
    with_objective(ModelKind::Linear, |objective| {
        let phases = short_phases(objective);
        let last = phases.len() - 1;
        let run = |directory: Option<&Path>, stop_after| {
            let checkpoints = directory.map(checkpoints);
            run_phases(objective, &phases, checkpoints.as_ref(), &mut |progress| {
                if progress.done == stop_after {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
        };
        let expected = run(None, usize::MAX).expect("the run is not stopped");
        for stop_after in [last * STEPS, last * STEPS + 1] {
            let scratch = tempfile::tempdir().expect("a temporary directory");
            let stopped = run(Some(scratch.path()), stop_after);
            assert!(matches!(stopped, Err(TrainError::Stopped(done)) if done == stop_after));
            let resumed = run(Some(scratch.path()), usize::MAX).expect("the run is not stopped");
            assert_eq!(resumed, expected, "stopped after {stop_after} steps");
        }
    });
}

/// The device's fit gives the coefficients of the trainer's net, a batch on lanes with the recipe's weights, and of its
/// correction. Some readings are missing.
#[test]
fn device_fits_like_trained_net() {
    let model = ModelKind::Linear;
    let options = TrainingOptions {
        missing: Some(0.5),
        ..TrainingOptions::new(model, SAMPLES, Schedule::Prior, Effort::Brief, 1)
    };
    let data = "procedural:12:3";
    let trained = train(&options, data, procedural(12, 3), None, &mut |_| {
        ControlFlow::Continue(())
    });
    let trained = trained.expect("training succeeds");
    let recipe = trained.file.recipe();
    let fit = recipe.estimator().coefficients().expect("coefficients");
    let (net, ridge) = (fit.net.expect("a net"), &fit.ridge);
    let (components, rows) = (ridge.precision.len(), net.bias.len());
    let hidden = rows - components;
    let scaled = |bytes: &[u8], scale: &dyn Fn(usize) -> f32| -> Vec<f32> {
        let bytes = bytes.iter().enumerate();
        bytes
            .map(|(index, byte)| f32::from(byte.cast_signed()) * scale(index))
            .collect()
    };
    let weights = [
        scaled(net.readings, &|index| net.reading_scales.get(index % rows)),
        net.bias.iter().collect(),
        scaled(net.output, &|index| net.output_scales.get(index / hidden)),
    ];
    let weights = weights.concat();
    let shape = Shape {
        samples: SAMPLES,
        components,
        hidden,
        units: 0,
        parameters: 0,
    };
    // More materials than a register has lanes, and not a multiple of them.
    let materials = Procedural::set(27, 77);
    let is_present = |material: usize, sample: usize| !(material + sample).is_multiple_of(4);
    let mut batch = Batch::new(shape, materials.len());
    let mut readings: Vec<Vec<(usize, [f32; 3])>> = Vec::new();
    for (index, material) in materials.iter().enumerate() {
        let samples = recipe.pattern().zip(ridge.center.iter()).enumerate();
        let present = samples.filter(|(sample, _)| is_present(index, *sample));
        let mapped = present.map(|(sample, (angles, center))| {
            let at = HalfDifference::from_angles(angles);
            let weight = at.cos_theta_i() * at.cos_theta_o();
            let reading = material.at_angles(angles);
            (sample, reading.map(|y| map(y, weight) - center))
        });
        let mapped: Vec<_> = mapped.collect();
        let scale = net.scale * (SAMPLES as f32 / mapped.len() as f32).sqrt();
        (0..SAMPLES).for_each(|sample| batch.set_reading(index, sample, None));
        for (sample, reading) in &mapped {
            batch.set_reading(index, *sample, Some(reading.map(|value| value * scale)));
        }
        readings.push(mapped);
    }
    let weights = CompletionWeights {
        shape,
        coefficient_net: &weights,
        start_net: &[],
    };
    complete(&mut batch, &weights);
    let precision = DVector::from_iterator(components, ridge.precision.iter());
    let (mut squared_error, mut squared_norm) = (0.0, 0.0);
    for (index, (material, mapped)) in materials.iter().zip(&readings).enumerate() {
        let mut read = |sample: u16, angles| {
            is_present(index, usize::from(sample)).then(|| material.at_angles(angles))
        };
        let outcome = scan_with_missing(&recipe, &mut read).expect("the fit succeeds");
        let entries = DMatrix::from_fn(mapped.len(), components, |row, column| {
            fit.rows().entry(mapped[row].0, column)
        });
        let system = entries.transpose() * &entries + DMatrix::from_diagonal(&precision);
        let system = Cholesky::new(system).expect("the system is positive definite");
        let completed = batch.coefficients(index);
        let channels = completed.chunks(components).enumerate();
        let expected: Vec<f32> = channels
            .flat_map(|(channel, completed)| {
                let completed = DVector::from_column_slice(completed);
                let mapped = mapped.iter().map(|(_, reading)| reading[channel]);
                let residual =
                    DVector::from_iterator(entries.nrows(), mapped) - &entries * &completed;
                let corrected = completed + system.solve(&(entries.transpose() * residual));
                corrected.iter().copied().collect::<Vec<f32>>()
            })
            .collect();
        assert_eq!(outcome.values.len(), expected.len());
        for (actual, expected) in outcome.values.iter().zip(expected) {
            squared_error += f64::from(actual - expected).powi(2);
            squared_norm += f64::from(expected).powi(2);
        }
    }
    let error = (squared_error / squared_norm).sqrt();
    assert!(error < 1e-4, "{error}");
}
