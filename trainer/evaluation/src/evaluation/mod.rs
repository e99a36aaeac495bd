//! Evaluation of methods: fits to a few samples of each material, compared with the material at many directions.

mod adam;
mod adaptive;
mod degradation;
mod estimate;
mod ggx;
mod leakage;
mod method;
mod target;

pub use adam::OPTIMUM_STEPS;
pub use adaptive::{Adaptive, AdaptiveScan};
pub use degradation::Degradation;
pub use estimate::Estimate;
pub use ggx::Ggx;
pub use glimpse_kernels::scan::{ScanOutcome, scan};
pub use leakage::{TrainingMaterials, TrainingOverlap};
pub use method::{
    Fitted, LINEAR_OPTIMUM_DIRECTIONS, Method, Outcome, SampleDirections, measure, names,
};
pub use target::{TargetReport, TargetScan};

use std::sync::atomic::{AtomicBool, Ordering};

use glimpse_core::geometry::HalfDifference;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::loss::{loss_directions, mean_log_error};
use glimpse_materials::setting::Name;
use glimpse_materials::{Brdf, Material};
use rayon::prelude::*;

use crate::metrics::{CompareError, Metrics};
use crate::render::{Picture, render_sphere};

/// The width and height of rendered spheres, in pixels.
///
/// `trainer render sphere` draws the same pictures by default. A size of 256 would make an evaluation five times slower
/// and change a material's color difference by less than 2 %.
pub const SPHERE_SIZE: usize = 128;

/// An error of evaluating a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A recipe of the model Linear was given without its basis.
    #[error("the recipe of the model linear has no basis; give the basis that was written with it")]
    Basis,
    /// A compact basis was exported from another basis, or the recipe's model is not Linear.
    #[error(
        "the compact basis does not belong to this recipe: it was exported from another basis, or the recipe is not of \
         the model linear; export it again from this recipe"
    )]
    Compact,
    /// A recipe that completes readings was given other directions than its own.
    #[error(
        "a recipe that completes readings works only at its own directions; give one that was trained with {} paper",
        Name("schedule")
    )]
    OtherDirections,
    /// A degradation of readings was given for a method without a recipe.
    #[error(
        "missing or noisy readings require a scan with a recipe; give {}",
        Name("recipe")
    )]
    DegradationWithoutRecipe,
    /// Readings are missing, and the recipe needs all of them.
    #[error(
        "the recipe needs all of its readings; for scans with missing readings, train a recipe with {} 0.5",
        Name("missing")
    )]
    NeedsAllReadings,
    /// A share of a degradation is out of range.
    #[error("{name} must be 0 to 1, not {1}", name = Name(.0))]
    Share(&'static str, f32),
    /// A degradation leaves no readings to fit.
    #[error(
        "{} {lost} of {} {first} leaves no reading to fit; drop fewer, or use more",
        Name("lose"),
        Name("first")
    )]
    NoReadings {
        /// The number of readings.
        first: usize,
        /// The number of readings to drop.
        lost: usize,
    },
    /// The requested number of leading readings exceeds the recipe's samples.
    #[error(
        "the first {first} readings are requested, but the recipe has {samples}; request at most {samples}"
    )]
    TooFewReadings {
        /// The requested number.
        first: usize,
        /// The number of the recipe's samples.
        samples: usize,
    },
    /// A basis does not belong to a recipe.
    #[error(transparent)]
    Count(#[from] glimpse_materials::basis::CoefficientCountError),
    /// A material cannot be scanned with a recipe.
    #[error(transparent)]
    Scan(#[from] glimpse_core::error::Error),
    /// A recipe has no upper bounds of the loss for scans that end early.
    #[error(
        "the recipe has no bounds of the loss for scans that end early; train one with {} 0.5, at least 2 samples and 10 \
         materials",
        Name("missing")
    )]
    NoPartialBound,
    /// A recipe has samples that exceed its own limits.
    #[error("the recipe has samples that exceed its own limits; train it again")]
    Unreachable,
    /// The caller stopped the evaluation.
    #[error("stopped before all materials were evaluated")]
    Stopped,
    /// Pictures cannot be compared. Does not happen in practice because all have the same size.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

/// An evaluator, which compares fits with the BRDF values and the rendered spheres of materials.
pub struct Evaluator<'a> {
    materials: &'a [Box<dyn Material>],
    at: Vec<HalfDifference<f32>>,
    references: Vec<Reference>,
}

struct Reference {
    values: Vec<[f32; 3]>,
    sphere: Picture,
}

/// The metrics of one material's fit.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MaterialMetrics {
    /// The name of the material.
    pub name: String,
    /// The metrics, averaged over the seeds.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// The loss that the recipe predicts from the readings, averaged over the seeds; None if it cannot predict one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_loss: Option<f64>,
    /// The upper bound of the loss for 90 % of materials, averaged over the seeds; None if the recipe has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss_bound: Option<f64>,
    /// True if the readings are unlike those of all training materials, for at least half of the seeds; None if the
    /// recipe cannot tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unlike_training: Option<bool>,
    /// True if the recipe was trained on the material; None if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trained_on: Option<bool>,
}

/// The metrics of a method.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Report {
    /// The name of the method.
    pub method: String,
    /// The name of the model.
    pub model: String,
    /// The number of samples, n.
    pub samples: usize,
    /// The means over the materials.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// The standard error of the mean loss over the materials; None for one material.
    pub loss_standard_error: Option<f64>,
    /// The mean time of a scan that chooses directions by seconds, in seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// The number of seeds.
    pub seeds: u64,
    /// The standard deviation of the mean loss over the seeds.
    pub loss_spread: f64,
    /// The metrics of each material.
    pub materials: Vec<MaterialMetrics>,
}

impl Report {
    /// Returns the loss of each material.
    #[must_use]
    pub fn losses(&self) -> Vec<f64> {
        let losses = self.materials.iter().map(|material| material.metrics.loss);
        losses.collect()
    }

    /// Returns the share of materials whose loss does not exceed its upper bound, if the recipe has bounds.
    #[must_use]
    pub fn bound_coverage(&self) -> Option<f64> {
        let holds = self
            .materials
            .iter()
            .map(|each| Some(each.metrics.loss <= each.loss_bound?));
        let holds: Option<Vec<bool>> = holds.collect();
        let holds = holds.filter(|list| !list.is_empty())?;
        Some(holds.iter().filter(|holds| **holds).count() as f64 / holds.len() as f64)
    }

    /// Returns the predicted loss of each material, if the recipe predicts losses.
    #[must_use]
    pub fn predicted_losses(&self) -> Option<Vec<f64>> {
        let predicted = self
            .materials
            .iter()
            .map(|material| material.predicted_loss);
        predicted.collect()
    }
}

/// Returns the mean of a value of predictions; None if one has no such value.
fn mean(
    predictions: &[Option<LossPrediction>],
    value: impl Fn(&LossPrediction) -> Option<f32>,
) -> Option<f64> {
    let values = predictions
        .iter()
        .map(|each| value(each.as_ref()?).map(f64::from));
    let sum: Option<f64> = values.sum();
    sum.map(|sum| sum / predictions.len() as f64)
}

impl Reference {
    fn new(material: &dyn Material, at: &[HalfDifference<f32>]) -> Self {
        let values = material.values_at(at);
        let sphere = render_sphere(material, SPHERE_SIZE).tone_map();
        Self { values, sphere }
    }

    /// Compares a BRDF with the material. Returns the metrics and the sphere of the BRDF.
    fn compare(
        &self,
        brdf: &dyn Brdf,
        at: &[HalfDifference<f32>],
    ) -> Result<(Metrics, Picture), CompareError> {
        let loss = mean_log_error(brdf, at, &self.values);
        let sphere = render_sphere(brdf, SPHERE_SIZE).tone_map();
        let metrics = Metrics::from_spheres(loss, &self.sphere, &sphere)?;
        Ok((metrics, sphere))
    }
}

/// Compares a BRDF with a material in the built-in studio.
///
/// # Errors
/// None in practice: both pictures have the same size.
pub fn compare(brdf: &dyn Brdf, material: &dyn Material) -> Result<Metrics, CompareError> {
    let at = loss_directions();
    let reference = Reference::new(material, &at);
    Ok(reference.compare(brdf, &at)?.0)
}

impl<'a> Evaluator<'a> {
    /// Evaluates and renders the materials in the built-in studio.
    #[must_use]
    pub fn new(materials: &'a [Box<dyn Material>]) -> Self {
        let at = loss_directions();
        let references = materials
            .par_iter()
            .map(|material| Reference::new(&**material, &at))
            .collect();
        Self {
            materials,
            at,
            references,
        }
    }

    /// Returns the materials.
    #[must_use]
    pub fn materials(&self) -> &'a [Box<dyn Material>] {
        self.materials
    }

    /// Returns the rendered sphere of a material.
    #[must_use]
    pub fn reference(&self, material: usize) -> &Picture {
        &self.references[material].sphere
    }

    /// Returns the loss of a BRDF.
    #[must_use]
    pub fn loss(&self, material: usize, fitted: &dyn Brdf) -> f64 {
        mean_log_error(fitted, &self.at, &self.references[material].values)
    }

    /// Compares a BRDF with a material. Returns the metrics and the sphere of the BRDF.
    ///
    /// # Errors
    /// None in practice: all pictures have the same size.
    pub fn compare(
        &self,
        material: usize,
        fitted: &dyn Brdf,
    ) -> Result<(Metrics, Picture), CompareError> {
        self.references[material].compare(fitted, &self.at)
    }

    /// Fits every material with a method and compares the fits. A random method runs once per seed.
    ///
    /// # Errors
    /// See [`EvaluationError`].
    pub fn evaluate(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
    ) -> Result<Report, EvaluationError> {
        self.evaluate_with_progress(method, seed, seeds, &|| {}, &AtomicBool::new(false))
    }

    /// Evaluates like [`evaluate`](Self::evaluate), and calls `done` after every material, on any thread. No new fit
    /// starts once `stop` is set.
    ///
    /// # Errors
    /// [`EvaluationError::Stopped`]
    pub fn evaluate_with_progress(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
        done: &(dyn Fn() + Sync),
        stop: &AtomicBool,
    ) -> Result<Report, EvaluationError> {
        let seeds = if method.is_random() { seeds.max(1) } else { 1 };
        let fits_by_material: Vec<Vec<(Metrics, Outcome)>> = (0..self.materials.len())
            .into_par_iter()
            .map(|material| {
                let fits = (0..seeds)
                    .map(|offset| {
                        if stop.load(Ordering::Relaxed) {
                            return Err(EvaluationError::Stopped);
                        }
                        // Each material and each repetition draws different samples.
                        let seed = seed.wrapping_add((offset << 32) | material as u64);
                        let outcome = method.fit_and_predict(&*self.materials[material], seed)?;
                        let (metrics, _) = self.compare(material, &outcome.fitted)?;
                        Ok((metrics, outcome))
                    })
                    .collect();
                done();
                fits
            })
            .collect::<Result<_, EvaluationError>>()?;
        let materials: Vec<MaterialMetrics> = self
            .materials
            .iter()
            .zip(&fits_by_material)
            .map(|(material, fits)| {
                let predictions: Vec<Option<LossPrediction>> =
                    fits.iter().map(|(_, outcome)| outcome.prediction).collect();
                MaterialMetrics {
                    name: material.name().to_owned(),
                    metrics: Metrics::mean_of_repetitions(fits.iter().map(|(metrics, _)| *metrics))
                        .unwrap_or_default(),
                    predicted_loss: mean(&predictions, |each| Some(each.loss)),
                    loss_bound: mean(&predictions, |each| each.bound),
                    unlike_training: mean(&predictions, |each| each.unlike_training.map(f32::from))
                        .map(|share| share >= 0.5),
                    trained_on: None,
                }
            })
            .collect();
        let mean_losses_by_seed: Vec<f64> = (0..seeds as usize)
            .map(|seed| {
                let losses = fits_by_material.iter().map(|fits| fits[seed].0.loss);
                losses.sum::<f64>() / fits_by_material.len() as f64
            })
            .collect();
        let losses: Vec<f64> = materials
            .iter()
            .map(|material| material.metrics.loss)
            .collect();
        let all = fits_by_material.iter().flatten();
        let seconds: Option<Vec<f64>> = all.map(|(_, outcome)| outcome.seconds).collect();
        Ok(Report {
            seconds: seconds.map(|all| Estimate::from_values(&all).mean),
            loss_standard_error: Estimate::from_values(&losses).standard_error,
            method: method.name().into(),
            model: method.model().name().into(),
            samples: method.samples(),
            metrics: Metrics::mean(materials.iter().map(|material| material.metrics))
                .unwrap_or_default(),
            seeds,
            loss_spread: standard_deviation(&mean_losses_by_seed),
            materials,
        })
    }
}

/// Returns the sample standard deviation; 0 for a single value.
fn standard_deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum_of_squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (sum_of_squares / (values.len().max(2) - 1) as f64).sqrt()
}
