//! Training: from materials to a recipe.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::Duration;

use glimpse_materials::MODELS;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::{self, CheckpointOptions};
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::request::TrainingArgs;
use glimpse_training::meta::run::train as meta_train;
use glimpse_training::recipe::{RecipeFile, pack_recipe};
use glimpse_training::route::LimitArgs;
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::arrays::Pairs;
use crate::choices::{choose, choose_value};
use crate::error::{Failure, GlimpseError, reject, reject_unused, to_exception};
use crate::interruptible::run_interruptible;
use crate::plan::speed_args;
use crate::recipe::PyRecipe;
use crate::sources::MaterialArgs;

/// Progress of a training run. `phase` names the part being trained, and `samples` is the size of its pattern. `done`
/// of `total` outer steps are complete. `loss` is smoothed over about 50 steps. `best` is the smallest loss yet,
/// on validation materials or over an epoch, or None.
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
        Self {
            phase: progress.phase,
            samples: progress.samples,
            done: progress.done,
            total: progress.total,
            loss: progress.loss,
            best: progress.best,
        }
    }
}

/// The number of samples.
#[derive(FromPyObject)]
pub(crate) enum SampleCount {
    Number(usize),
    Text(String),
}

/// Trains a recipe as `trainer train` does; the same options give the same bytes.
///
/// `model` is "phong", "cook-torrance", "linear" or "neural". `samples` is the number of readings n (default 8),
/// or "any" for a recipe without a pattern, for readings at any directions. `materials` are the training materials: a source as for `load_materials`, a Material, or a list of both (default
/// "procedural:100"). `seed` determines all random choices (default 0).
///
/// `effort` is "brief" (seconds), "quick" (10 to 120 seconds on two cores), "standard" (1 to 5 minutes, the default) or
/// "long" (15 minutes to hours).
/// `schedule` is "prior" (a learned prior completes the readings, the default) or "paper" (the two stages of the paper).
///
/// Some options require schedule="prior". `share` gives the proportions of training tasks from several sources; all
/// Material objects together count as one source. `missing` is the share of training tasks with missing readings; a
/// recipe tolerates missing readings if `missing` is above 0. `noise` is the relative standard deviation of readings.
/// `additive` is the standard deviation of additive noise, as a share of the BRDF of a white surface, 1/pi. `levels` is
/// the number of quantization levels of the sensor, 0 for none. `procedural` is the share of training tasks that are
/// procedural materials (default 0.4). The limits of the machine are `max_theta_i_degrees` (default 90),
/// `max_theta_o_degrees` (default 90) and `min_separation_degrees` (default 0); with `in_plane`, light, normal and sensor
/// always lie in one plane. `pattern` (k, 2, 3) has directions that the instrument fixes; the remaining ones of `samples`
/// are trained. `scan_seconds` is the longest time of a
/// scan, motion and settling together (default: any time), on a machine with `speed_degrees_per_second` (default 10) and
/// `settle_seconds` (default 0.5) as in `Recipe.plan`.
///
/// Two options require the model linear and schedule="paper". `bases` is the number of principal components.
/// `eta` is the precision of their coefficients.
///
/// `progress` is called with a Progress at most 50 times per second and at the end. By default it draws a bar in a terminal
/// or notebook; False draws none. If it raises an exception, training
/// stops and `train` raises that exception. `checkpoint` is a folder in which the run is saved every
/// `checkpoint_every_seconds` (default 10), and after Ctrl-C or an exception of `progress`. The same call with
/// `resume=True` continues the run and gives the same bytes. A finished run deletes its checkpoints, and the folder if
/// it is then empty.
#[pyfunction]
#[pyo3(signature = (
    model, materials = None, *, samples = None, schedule = "prior", effort = "standard", seed = 0, share = None,
    missing = None, noise = None, additive = None, levels = None, procedural = None,
    max_theta_i_degrees = None, max_theta_o_degrees = None, min_separation_degrees = None, in_plane = false,
    pattern = None, scan_seconds = None, speed_degrees_per_second = None, settle_seconds = None, bases = None, eta = None,
    checkpoint = None, checkpoint_every_seconds = 10.0, resume = false, progress = None,
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments in Python")]
pub(crate) fn train(
    py: Python<'_>,
    model: &str,
    materials: Option<&Bound<'_, PyAny>>,
    samples: Option<SampleCount>,
    schedule: &str,
    effort: &str,
    seed: u64,
    share: Option<Vec<f32>>,
    missing: Option<f32>,
    noise: Option<f32>,
    additive: Option<f32>,
    levels: Option<u32>,
    procedural: Option<f32>,
    max_theta_i_degrees: Option<f32>,
    max_theta_o_degrees: Option<f32>,
    min_separation_degrees: Option<f32>,
    in_plane: bool,
    pattern: Option<&Bound<'_, PyAny>>,
    scan_seconds: Option<f64>,
    speed_degrees_per_second: Option<&Bound<'_, PyAny>>,
    settle_seconds: Option<f64>,
    bases: Option<usize>,
    eta: Option<f32>,
    checkpoint: Option<PathBuf>,
    checkpoint_every_seconds: f64,
    resume: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyRecipe> {
    let progress = match progress {
        Some(progress) => {
            Some(progress).filter(|progress| !progress.bind(py).is(PyBool::new(py, false)))
        }
        None => py
            .import("glimpse_brdf.progress")?
            .call_method0("bar")?
            .extract()?,
    };
    let model = choose("model", model, &MODELS.map(|model| (model.name(), model)))?;
    let schedule = choose_value("schedule", schedule, Schedule::name)?;
    let args = TrainingArgs {
        share: share.unwrap_or_default(),
        missing,
        noise,
        additive,
        levels,
        procedural,
        limits: LimitArgs {
            max_theta_i: max_theta_i_degrees,
            max_theta_o: max_theta_o_degrees,
            min_separation: min_separation_degrees,
            in_plane,
        },
        scan_seconds,
        speeds: speed_args(speed_degrees_per_second, settle_seconds)?,
        bases,
        eta,
    };
    args.check_effect(&[model], schedule)
        .map_err(to_exception)?;
    reject_unused(
        checkpoint.is_none(),
        "it requires checkpoint",
        &[("resume", resume)],
    )?;
    let effort = choose_value("effort", effort, Effort::name)?;
    let samples = match samples {
        None => 8,
        Some(SampleCount::Number(0)) => return reject("samples is 0: give 1 to 4096, or \"any\""),
        Some(SampleCount::Number(count)) => count,
        Some(SampleCount::Text(text)) => choose("samples", &text, &[("any", 0)])?,
    };
    let options = args.options(model, samples, schedule, effort, seed);
    let options = options.map_err(to_exception)?;
    let fixed = pattern.map(|pattern| Pairs::from_arrays(pattern, None)?.angles());
    let fixed = fixed.transpose()?;
    let options = options.with_fixed(fixed.unwrap_or_default());
    let options = options.map_err(to_exception)?;
    let options = Options {
        checkpoints: checkpoints(checkpoint, checkpoint_every_seconds, resume)?,
        ..options
    };
    let materials = match materials {
        Some(materials) => MaterialArgs::parse(materials)?,
        None => MaterialArgs::parse(&pyo3::types::PyString::new(py, "procedural:100"))?,
    };
    let sources = materials.sources(&args.share)?;

    let latest = Mutex::new(None);
    let report = |py: Python<'_>| {
        let latest = latest.lock().ok().and_then(|mut latest| latest.take());
        match (&progress, latest) {
            (Some(progress), Some(latest)) => {
                progress.call1(py, (PyProgress::from(latest),)).map(drop)
            }
            _ => Ok(()),
        }
    };
    let result = run_interruptible(py, report, |stop| {
        let (materials, source_shares) = materials.load(&sources)?;
        let options = Options {
            source_shares,
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
        let learned = meta_train(&options, materials, observe).map_err(Failure::new)?;
        let file = pack_recipe(&learned, &options, &sources.label()).map_err(Failure::new)?;
        Ok::<(RecipeFile, Option<Vec<u8>>), Failure>((file, learned.basis))
    })?;
    let (file, basis) = result?;
    if let Some(checkpoints) = &options.checkpoints {
        Checkpoint::remove(&checkpoints.directory);
    }
    PyRecipe::new_with_basis(file, basis.as_deref())
}

/// Returns the checkpoint options. Without `resume`, an unfinished run in the folder is an error.
fn checkpoints(
    directory: Option<PathBuf>,
    seconds: f64,
    resume: bool,
) -> PyResult<Option<CheckpointOptions>> {
    let Some(directory) = directory else {
        return Ok(None);
    };
    let interval = Duration::try_from_secs_f64(seconds).map_err(|_| {
        GlimpseError::new_err(format!(
            "checkpoint_every_seconds is {seconds}: pass a finite, nonnegative number of seconds"
        ))
    })?;
    if !resume && Checkpoint::exists_in(&directory) {
        return reject(format!(
            "{} holds an unfinished run: pass resume=True to continue it, or remove the folder to discard it",
            directory.display()
        ));
    }
    Ok(Some(CheckpointOptions {
        directory,
        interval,
        resume,
    }))
}
