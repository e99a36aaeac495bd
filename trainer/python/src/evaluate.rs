//! Evaluation of a recipe on materials.

use std::sync::atomic::AtomicBool;

use glimpse_evaluation::evaluation::{Degradation, Evaluator, Method};
use pyo3::prelude::*;

use crate::arrays::to_python;
use crate::error::Result;
use crate::integer;
use crate::interruptible::run_interruptible;
use crate::recipe::PyRecipe;
use crate::sources::MaterialArgs;

/// Evaluates a recipe on materials, as `trainer evaluate` does. Each material is sampled at the recipe's directions
/// and fitted, and the fit is compared with the whole material.
///
/// Readings may be degraded. Only the `first` samples of the recipe are measured (default all), and `lose` of them are
/// removed at random (default 0). `noise` is the relative standard deviation, 0 to 1 (default 0). `additive` is the
/// standard deviation of additive noise as a share of the BRDF of a white surface, 1/pi, 0 to 1 (default 0). `levels`
/// is the number of quantization levels of the sensor (default 0, for none). Random degradations are averaged over
/// `seeds` seeds, 1 to 10,000 (default 5).
///
/// Returns a dict of means over the materials: loss (see `loss`); dssim, l2, psnr and delta_e (mean CIEDE2000 over the
/// sphere's disc) of a rendered sphere of 128 x 128 pixels; loss_standard_error; and loss_spread, the standard
/// deviation over seeds. Its entry `materials` is a list of dicts of name, loss, dssim, l2, psnr, delta_e,
/// predicted_loss, loss_bound (holds for 90 % of materials) and unlike_training. The last three are None if the recipe
/// does not predict them. Its entry `trained_on` lists the materials that are training materials of the recipe.
/// `namesakes_trained_on` lists the materials that have only the name of a training material. The losses of both are
/// not estimates for unseen materials. Both entries are None if the recipe does not list its training materials.
///
/// `threads` is the number of threads, as in `train`.
#[pyfunction]
#[pyo3(signature = (
    recipe, materials, *, first = None, lose = 0, noise = 0.0, additive = 0.0, levels = 0, seeds = 5, seed = 0,
    threads = None,
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments in Python")]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    recipe: &Bound<'py, PyRecipe>,
    materials: &Bound<'py, PyAny>,
    first: Option<&Bound<'_, PyAny>>,
    #[pyo3(from_py_with = integer::lose)] lose: usize,
    noise: f32,
    additive: f32,
    #[pyo3(from_py_with = integer::levels)] levels: u32,
    #[pyo3(from_py_with = integer::seeds)] seeds: u64,
    #[pyo3(from_py_with = integer::seed)] seed: u64,
    threads: Option<&Bound<'_, PyAny>>,
) -> Result<Bound<'py, PyAny>> {
    let threads = threads.map_or(Ok(0), integer::threads).map(Some)?;
    let degradation = Degradation {
        first: first.map(integer::first).transpose()?,
        lost: lose,
        noise,
        additive,
        levels,
    };
    let recipe = recipe.get();
    let parsed = recipe.recipe();
    degradation.validate(parsed.samples(), Some(&parsed))?;
    let mut method = Method::with_recipe(&parsed, recipe.0.basis.as_deref())?;
    method.degradation = degradation;
    let materials = MaterialArgs::parse(materials, &[])?;
    let report = |stop: &AtomicBool| {
        let (materials, _) = materials.load()?;
        let evaluator = Evaluator::new(&materials);
        let report = evaluator.evaluate_with_progress(&method, seed, seeds, &|| {}, stop)?;
        Result::Ok(report.with_overlaps(&recipe.0.file.metadata().materials, &materials))
    };
    to_python(py, run_interruptible(py, threads, |_| Ok(()), report)??)
}
