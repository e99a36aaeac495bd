//! Training: from materials to a recipe.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_fitting::route::MachineArgs;
use glimpse_training::checkpoint::TrainingState;
use glimpse_training::outer::{self, Checkpoints};
use glimpse_training::run::{check, train as meta_train};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::arrays::{Pairs, from_python};
use crate::error::{Result, reject};
use crate::integer::{self, integer};
use crate::interruptible::run_interruptible;
use crate::machine::PyMachine;
use crate::recipe::PyRecipe;
use crate::sources::MaterialArgs;

/// Trains a recipe as `trainer train` does; the same options give the same bytes on any number of
/// threads, and on processors with the same vector instructions (AVX-512, AVX2 or NEON) and C library.
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
/// procedural materials (default 0.4). `machine` is a `Machine`, which measures the pattern. `pattern` (k, 2, 3) has
/// directions that the instrument fixes; the remaining ones of `samples` are trained. `scan_seconds` is the longest time
/// of a scan, motion and settling together (default: any time).
///
/// Two options require the model linear and schedule="paper". `bases` is the number of principal components.
/// `eta` is the precision of their coefficients.
///
/// `progress` is called with a Progress at most 50 times per second and at the end. By default it draws a bar in a terminal
/// or notebook; False draws none. If it raises an exception, training
/// stops and `train` raises that exception. `checkpoint` is a folder in which the run is saved at least every 10 seconds,
/// and after Ctrl-C or an exception of `progress`. The same call with
/// `resume=True` continues the run and gives the same bytes, on such processors. A finished run deletes its checkpoints, and
/// the folder if it is then empty. `threads` is the number of threads, 1 to 1024 (default: as many as all computations of the module).
#[pyfunction]
#[pyo3(signature = (
    model, materials = None, *, machine = None, pattern = None, checkpoint = None, resume = false, progress = None,
    threads = None, **options
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments in Python")]
pub(crate) fn train(
    py: Python<'_>,
    model: &str,
    materials: Option<&Bound<'_, PyAny>>,
    machine: Option<&Bound<'_, PyMachine>>,
    pattern: Option<&Bound<'_, PyAny>>,
    checkpoint: Option<PathBuf>,
    resume: bool,
    progress: Option<Bound<'_, PyAny>>,
    threads: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> Result<PyRecipe> {
    let module = py.import("glimpse_brdf.progress")?;
    let progress = match progress {
        Some(progress) => progress,
        None => module.call_method0("bar")?,
    };
    let is_drawn = !progress.is_none() && !matches!(progress.extract(), Ok(false));
    let progress = is_drawn.then(|| progress.unbind());
    if resume && checkpoint.is_none() {
        return reject("resume has no effect: it requires checkpoint");
    }
    let threads = threads.map_or(Ok(0), integer::threads)?;
    let MachineArgs { limits, speeds } = PyMachine::args(machine);
    let mut options = TrainingOptions {
        limits,
        speeds,
        ..parse_options(options, model)?
    };
    if let Some(pattern) = pattern {
        options.pattern = Pairs::from_arrays(pattern, None, &[])?.angles()?;
    }
    check(&options)?;
    let checkpoints = checkpoints(checkpoint, resume)?;
    let default = PyString::new(py, "procedural:100").into_any();
    let materials = MaterialArgs::parse(materials.unwrap_or(&default), &options.share)?;

    let latest = Mutex::new(None);
    let new_progress = module.getattr("Progress")?.unbind();
    let report = |py: Python<'_>| {
        let latest: Option<outer::TrainingProgress> =
            latest.lock().ok().and_then(|mut latest| latest.take());
        if let (Some(progress), Some(latest)) = (&progress, latest) {
            let (phase, samples, done) = (latest.phase, latest.samples, latest.done);
            let fields = (phase, samples, done, latest.total, latest.loss, latest.best);
            progress.call1(py, (new_progress.call1(py, fields)?,))?;
        }
        Ok(())
    };
    let result = run_interruptible(py, Some(threads), report, |stop| {
        let data = materials.sources.label();
        let (materials, source_shares) = materials.load()?;
        options.source_shares = source_shares;
        let observe = &mut |progress: &outer::TrainingProgress| {
            if let Ok(mut latest) = latest.lock() {
                *latest = Some(*progress);
            }
            if stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let trained = meta_train(&options, &data, materials, checkpoints.as_ref(), observe);
        Result::Ok(trained?)
    })?;
    let trained = result?;
    if let Some(checkpoints) = &checkpoints {
        TrainingState::remove(&checkpoints.directory);
    }
    PyRecipe::new_with_basis(trained.file, trained.basis.as_deref())
}

/// Returns the options with the given values, by their names.
fn parse_options(given: Option<&Bound<'_, PyDict>>, model: &str) -> Result<TrainingOptions> {
    let (model, schedule) = (from_json("model", model.into())?, Schedule::Prior);
    let mut options = TrainingOptions::new(model, 8, schedule, Effort::Standard, 0);
    let mut all = json!(options);
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        let value = match &*name {
            _ if value.is_none() => continue,
            "samples" if value.eq("any")? => json!(0),
            "samples" => json!(integer::<usize>(&value, "samples (or \"any\")", 1..=4096)?),
            _ if all.get(&name).is_some_and(Value::is_u64) => {
                json!(integer::<u64>(&value, &name, 0..=u64::MAX)?)
            }
            _ => from_python(&value)?,
        };
        match all.get_mut(&name) {
            Some(option) if !NOT_GIVEN.contains(&&*name) => *option = value,
            _ => {
                let message = format!("train() got an unexpected keyword argument '{name}'");
                return Err(PyTypeError::new_err(message).into());
            }
        }
        options = from_json(&name, all.clone())?;
    }
    Ok(options)
}

/// Converts JSON. `name` is the name of a parameter for the error.
fn from_json<T: DeserializeOwned>(name: &str, value: Value) -> Result<T> {
    serde_json::from_value(value).or_else(|error| reject(format!("{name}: {error}")))
}

/// The fields that are not given by name: other arguments determine them.
const NOT_GIVEN: [&str; 6] = [
    "model",
    "parts",
    "pattern",
    "source_shares",
    "limits",
    "speeds",
];

/// Returns the checkpoints. Without `resume`, an unfinished run in the folder is an error.
fn checkpoints(directory: Option<PathBuf>, resume: bool) -> Result<Option<Checkpoints>> {
    let Some(directory) = directory else {
        return Ok(None);
    };
    if !resume && TrainingState::exists_in(&directory) {
        return reject(format!(
            "{} holds an unfinished run: pass resume=True to continue it, or remove the folder to discard it",
            directory.display()
        ));
    }
    Ok(Some(Checkpoints { directory, resume }))
}
