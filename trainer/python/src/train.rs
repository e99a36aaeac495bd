//! Training: from materials to a recipe.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::Duration;

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_materials::SourceError;
use glimpse_training::linear::Prior;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::options::{CompletionOptions, Options};
use glimpse_training::meta::outer::{self, Checkpoints};
use glimpse_training::meta::plan::Schedule;
use glimpse_training::meta::run::{TrainError, train as meta_train};
use glimpse_training::recipe::{DescribeError, RecipeFile, recipe_of};
use pyo3::prelude::*;

use crate::choices::{EFFORTS, MODELS, SCHEDULES, choose, limits};
use crate::error::{GlimpseError, raised, refused};
use crate::recipe::PyRecipe;
use crate::sources::Given;
use crate::waiting::waiting;

/// How far a training run is: `phase`, what is being trained; `samples` of its pattern; `done` of `total` outer steps;
/// `loss`, smoothed over some fifty steps; `best`, the best so far of those that may be kept, or None.
#[pyclass(frozen, get_all, name = "Progress", module = "glimpse_brdf")]
pub(crate) struct PyProgress {
    phase: &'static str,
    samples: usize,
    done: usize,
    total: usize,
    loss: f32,
    best: Option<f32>,
}

#[pymethods]
impl PyProgress {
    fn __repr__(&self) -> String {
        format!(
            "<glimpse_brdf.Progress {}: {} of {}, loss {:.4}>",
            self.phase, self.done, self.total, self.loss
        )
    }
}

impl From<outer::Progress> for PyProgress {
    fn from(progress: outer::Progress) -> Self {
        let outer::Progress {
            phase,
            samples,
            done,
            total,
            loss,
            best,
        } = progress;
        Self {
            phase,
            samples,
            done,
            total,
            loss,
            best,
        }
    }
}

/// Why there is no recipe.
enum Failure {
    Source(SourceError),
    Train(TrainError),
    DescribeError(DescribeError),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Source(error) => raised(error),
            Failure::Train(error) => raised(error),
            Failure::DescribeError(error) => raised(error),
        }
    }
}

/// Trains a recipe for n = `samples` readings of a `model`, "phong", "cook-torrance", "linear" or "neural"; as `trainer
/// train`: the same options give the same bytes.
///
/// `materials` is what it learns on: a source as `load_materials` takes it, a Material, or a list of both
/// (procedural:100 unless given); `share` says in what proportion tasks are taken of each of several sources, where all
/// Materials together are one.
///
/// `effort` is "brief" (seconds), "quick" (a minute), "standard" or "long"; `schedule` is "prior" (readings are completed),
/// "joint" or "paper". For schedule="prior" alone: `missing`, the share of training in which readings are missing, above
/// 0 for recipes that take missing ones; `noise` of readings, relative; `additive`, the same as a share of a white
/// surface, whose BRDF is 1/pi; `levels` of the sensor; `procedural`, the share of built-in materials (0.4); and the
/// machine's `max_theta_i_degrees`, `max_theta_o_degrees` (90) and `min_separation_degrees` (0). For the model linear by
/// schedule="joint" and "paper": `bases`, how many principal components, and `eta`, the precision of their coefficients.
///
/// `progress` is called with a Progress, at most fifty times a second and at the end; what it raises ends the run and is
/// raised. `checkpoint` is a folder in which the run is saved every `checkpoint_every_seconds`, and when it is ended by
/// Ctrl-C or `progress`; the same call with `resume` goes on, and comes to the same bytes. It is removed in the end.
#[pyfunction]
#[pyo3(signature = (
    model, materials = None, *, samples = 8, schedule = "prior", effort = "standard", seed = 0, share = None,
    missing = None, noise = None, additive = None, levels = None, procedural = None,
    max_theta_i_degrees = None, max_theta_o_degrees = None, min_separation_degrees = None, bases = None, eta = None,
    checkpoint = None, checkpoint_every_seconds = 10.0, resume = false, progress = None,
))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub(crate) fn train(
    py: Python<'_>,
    model: &str,
    materials: Option<&Bound<'_, PyAny>>,
    samples: usize,
    schedule: &str,
    effort: &str,
    seed: u64,
    share: Option<Vec<f32>>,
    missing: Option<f32>,
    noise: Option<f32>,
    additive: Option<f32>,
    levels: Option<u32>,
    procedural: Option<f32>,
    max_theta_i_degrees: Option<f64>,
    max_theta_o_degrees: Option<f64>,
    min_separation_degrees: Option<f64>,
    bases: Option<usize>,
    eta: Option<f64>,
    checkpoint: Option<PathBuf>,
    checkpoint_every_seconds: f64,
    resume: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyRecipe> {
    let model = choose("model", model, &MODELS)?;
    let schedule = choose("schedule", schedule, &SCHEDULES)?;
    refuse_in_vain(
        schedule != Schedule::Prior,
        "it is for schedule=\"prior\"",
        &[
            ("share", share.is_some()),
            ("missing", missing.is_some()),
            ("noise", noise.is_some()),
            ("additive", additive.is_some()),
            ("levels", levels.is_some()),
            ("procedural", procedural.is_some()),
            ("max_theta_i_degrees", max_theta_i_degrees.is_some()),
            ("max_theta_o_degrees", max_theta_o_degrees.is_some()),
            ("min_separation_degrees", min_separation_degrees.is_some()),
        ],
    )?;
    let of_linear = [("bases", bases.is_some()), ("eta", eta.is_some())];
    refuse_in_vain(
        model != ModelKind::Linear,
        "it is for the model linear",
        &of_linear,
    )?;
    refuse_in_vain(
        schedule == Schedule::Prior,
        "it is for schedule=\"joint\" and \"paper\"",
        &of_linear,
    )?;
    refuse_in_vain(
        checkpoint.is_none(),
        "there is no checkpoint",
        &[("resume", resume)],
    )?;
    let default = CompletionOptions::of(samples);
    let options = Options {
        prior: prior(schedule, bases, eta)?,
        completion_options: CompletionOptions {
            missing: missing.unwrap_or(default.missing),
            noise: noise.unwrap_or(default.noise),
            additive: additive.unwrap_or(default.additive),
            levels: levels.unwrap_or(default.levels),
            procedural: procedural.unwrap_or(default.procedural),
            limits: limits(
                Limits::NONE,
                max_theta_i_degrees,
                max_theta_o_degrees,
                min_separation_degrees,
            ),
        },
        checkpoints: checkpoints(checkpoint, checkpoint_every_seconds, resume)?,
        ..Options::new(
            model,
            samples,
            schedule,
            choose("effort", effort, &EFFORTS)?,
            seed,
        )
    };
    options.completion_options.validate().map_err(raised)?;
    let given = match materials {
        Some(materials) => Given::of(materials)?,
        None => Given::of(&pyo3::types::PyString::new(py, "procedural:100"))?,
    };
    let sources = given.sources(share.as_deref().unwrap_or_default())?;
    if share.is_some() && sources.each().len() == 1 {
        return refused("share has no effect with a single source");
    }

    let latest = Mutex::new(None);
    let tell = |py: Python<'_>| {
        let news = latest.lock().ok().and_then(|mut latest| latest.take());
        match (&progress, news) {
            (Some(progress), Some(news)) => progress.call1(py, (PyProgress::from(news),)).map(drop),
            _ => Ok(()),
        }
    };
    let found = waiting(py, tell, |stop| {
        let (materials, portions) = given.load(&sources).map_err(Failure::Source)?;
        let options = Options {
            portions,
            ..options.clone()
        };
        let observe = &mut |progress: &outer::Progress| {
            if let Ok(mut latest) = latest.lock() {
                *latest = Some(*progress);
            }
            match stop.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let learned = meta_train(&options, materials, observe).map_err(Failure::Train)?;
        let file =
            recipe_of(&learned, &options, &sources.label()).map_err(Failure::DescribeError)?;
        Ok::<(RecipeFile, Option<Vec<u8>>), Failure>((file, learned.basis))
    })?;
    let (file, basis) = found?;
    if let Some(checkpoints) = &options.checkpoints {
        Checkpoint::remove(&checkpoints.directory);
    }
    PyRecipe::of_bytes(file, basis.as_deref())
}

/// Refuses, by name, what was given in vain.
fn refuse_in_vain(in_vain: bool, why: &str, options: &[(&str, bool)]) -> PyResult<()> {
    match options.iter().find(|(_, given)| in_vain && *given) {
        Some((name, _)) => refused(format!("{name} has no effect: {why}")),
        None => Ok(()),
    }
}

/// What was asked for of Linear's coefficients, and the schedule's default where nothing was.
fn prior(schedule: Schedule, bases: Option<usize>, eta: Option<f64>) -> PyResult<Prior> {
    let default = match schedule {
        Schedule::Paper => Prior::PAPER,
        Schedule::Joint | Schedule::Prior => Prior::LEARNED,
    };
    if bases.is_some_and(|bases| !(1..=1024).contains(&bases)) {
        return refused("bases must be 1 to 1024");
    }
    if eta.is_some_and(|eta| !(eta > 0.0 && eta.is_finite())) {
        return refused("eta must be a positive number");
    }
    Ok(Prior {
        components: bases.unwrap_or(default.components),
        eta: eta.or(default.eta),
    })
}

/// Where the run is saved; an unfinished one is not thrown away unasked.
fn checkpoints(
    directory: Option<PathBuf>,
    seconds: f64,
    resume: bool,
) -> PyResult<Option<Checkpoints>> {
    let Some(directory) = directory else {
        return Ok(None);
    };
    let every = Duration::try_from_secs_f64(seconds);
    let every = every
        .map_err(|error| GlimpseError::new_err(format!("checkpoint_every_seconds: {error}")))?;
    if !resume && Checkpoint::is_in(&directory) {
        return refused(format!(
            "{} holds a run that was not finished: give resume=True to go on with it, or remove it to throw it \
             away",
            directory.display()
        ));
    }
    Ok(Some(Checkpoints {
        directory,
        every,
        resume,
    }))
}
