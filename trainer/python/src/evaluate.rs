//! How well a recipe does on materials.

use std::sync::atomic::Ordering;

use glimpse_materials::SourceError;
use glimpse_trainer::evaluation::{
    EvaluationError, Evaluator, Known, Method, Readings, Report, TrainedOn,
};
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::error::{GlimpseError, raised, refused};
use crate::recipe::PyRecipe;
use crate::sources::Given;
use crate::waiting::waiting;

/// Why there is no report.
enum Failure {
    Source(SourceError),
    Evaluator(EvaluationError),
}

/// Judges a recipe on materials, as `trainer evaluate`: each is read at the recipe's directions and fitted, and the fit
/// is compared with the whole of it.
///
/// Readings may be spoilt: only the `first` so many are taken, `lose` of them are lost, `noise` is relative, `additive` a
/// share of a white surface, whose BRDF is 1/pi, `levels` those of the sensor; what is random is repeated `seeds` times.
///
/// The answer is a dict of means over the materials: loss (see `loss`); dssim, l2, psnr and delta_e (mean CIEDE2000 over
/// the sphere's disc) of a rendered sphere of 128 x 128 pixels; loss_standard_error, loss_spread from seed to seed; of
/// materials, a list of dicts of name, loss, dssim, l2, psnr, delta_e and predicted_loss; and of trained_on and namesakes_trained_on, names of those whose loss says nothing of
/// unseen ones (None if the recipe does not say what it was trained on).
#[pyfunction]
#[pyo3(signature = (
    recipe, materials, *, first = None, lose = 0, noise = 0.0, additive = 0.0, levels = 0, seeds = 5, seed = 0,
))]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    recipe: &Bound<'py, PyRecipe>,
    materials: &Bound<'py, PyAny>,
    first: Option<usize>,
    lose: usize,
    noise: f32,
    additive: f32,
    levels: u32,
    seeds: u64,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    for (name, share) in [("noise", noise), ("additive", additive)] {
        if !(0.0..=1.0).contains(&share) {
            return refused(format!("{name} must be 0 to 1, not {share}"));
        }
    }
    if !(1..=10_000).contains(&seeds) {
        return refused("seeds must be 1 to 10000");
    }
    let readings = Readings {
        first,
        lost: lose,
        noise,
        additive,
        levels,
    };
    let recipe = recipe.get();
    let parsed = recipe.recipe();
    if first == Some(0) || lose >= first.unwrap_or(usize::MAX).min(parsed.samples()) {
        return refused("first and lose leave nothing to fit");
    }
    let trained_on = TrainedOn::of_recipe(&parsed).map_err(raised)?;
    let method = Method::ours(&parsed, recipe.basis.as_deref()).map_err(raised)?;
    let method = match readings == Readings::default() {
        true => method,
        false => method.with_readings(readings).map_err(raised)?,
    };
    let given = Given::of(materials)?;
    let sources = given.sources(&[])?;
    let judged = waiting(
        py,
        |_| Ok(()),
        |stop| {
            let (materials, _) = given.load(&sources).map_err(Failure::Source)?;
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::Evaluator(EvaluationError::Stopped));
            }
            let judge = Evaluator::new(&materials);
            let report = judge
                .evaluate_with_progress(&method, seed, seeds, &|| {}, stop)
                .map_err(Failure::Evaluator)?;
            let known = trained_on.as_ref().map(|trained_on| {
                let known = materials
                    .iter()
                    .map(|material| trained_on.knows(&**material));
                known.collect()
            });
            Ok((report, known))
        },
    )?;
    let (report, known) = judged.map_err(|failure| match failure {
        Failure::Source(error) => raised(error),
        Failure::Evaluator(error) => raised(error),
    })?;
    let text = to_json(&report, known).map_err(|error| GlimpseError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// What was found, and which of the materials the recipe was trained on; None if it does not say.
fn to_json(report: &Report, known: Option<Vec<Option<Known>>>) -> serde_json::Result<String> {
    let mut value = serde_json::to_value(report)?;
    for (index, material) in report.materials.iter().enumerate() {
        // Also where it is not predicted.
        value["materials"][index]["predicted_loss"] = json!(material.predicted_loss);
    }
    let names = |kind: Known| -> Value {
        let Some(known) = &known else {
            return Value::Null;
        };
        let all = known.iter().zip(&report.materials);
        let of_kind = all.filter(|(known, _)| **known == Some(kind));
        of_kind.map(|(_, material)| material.name.clone()).collect()
    };
    value["trained_on"] = names(Known::Same);
    value["namesakes_trained_on"] = names(Known::Namesake);
    serde_json::to_string(&value)
}
