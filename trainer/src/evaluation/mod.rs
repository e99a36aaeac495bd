//! Judging methods on materials: fit each from a few of its samples, compare with all of it.

mod adam;
mod leakage;
mod method;
mod readings;
mod uncertainty;

pub use adam::OPTIMUM_STEPS;
pub use glimpse_kernels::scan::{Found, scan};
pub use leakage::{Known, TrainedOn};
pub use method::{Method, measure};
pub use readings::Readings;
pub use uncertainty::Estimate;

use std::sync::atomic::{AtomicBool, Ordering};

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::loss::{loss_directions, mean_log_error};
use glimpse_materials::setting::{NamesSettings, Naming, Setting};
use glimpse_materials::{Fitted, Material};
use rayon::prelude::*;

use crate::metrics::{CompareError, Metrics};
use crate::render::{Environment, Picture, render_sphere};

/// Width and height of the spheres that metrics are of, in pixels.
///
/// `trainer render sphere --size 128` draws the same pictures. Its default of 256 would make an
/// evaluation five times slower; a material's color difference there is within 2 % of that here.
pub const SPHERE: usize = 128;

/// Why a method cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A recipe of the model Linear came without its basis.
    #[error("a recipe of the model linear needs the basis that was written beside it")]
    Basis,
    /// A compact basis was made of another basis, or for a model that has none.
    #[error(
        "the compact basis is not of this recipe: it was made of another whole basis, or the recipe \
         is not of the model linear; export it again from this recipe"
    )]
    Compact,
    /// A completion was asked to do without its own directions.
    #[error("{}", self.message(Setting::name))]
    Elsewhere,
    /// Readings were to be spoilt where there are none of a recipe's.
    #[error("{}", self.message(Setting::name))]
    Readings,
    /// Readings were to be lost that the recipe cannot do without.
    #[error("{}", self.message(Setting::name))]
    NeedsAll,
    /// More of the first readings were asked for than there are.
    #[error("the first {first} readings are asked for, and the recipe has {samples}")]
    FewerReadings {
        /// How many were asked for.
        first: usize,
        /// How many there are.
        samples: usize,
    },
    /// A ridge problem has no solution.
    #[error("the linear model cannot be fitted: {0}")]
    Ridge(#[from] glimpse_core::fit::ridge::RidgeError),
    /// A basis does not belong to a recipe.
    #[error(transparent)]
    Count(#[from] glimpse_materials::basis::CountError),
    /// A material cannot be scanned by a recipe.
    #[error(transparent)]
    Scan(#[from] glimpse_kernels::scan::HostScanError),
    /// Whoever waits for it asked to stop.
    #[error("stopped before all materials were judged")]
    Stopped,
    /// Pictures cannot be compared: never in practice, all have the same size.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

impl NamesSettings for EvaluationError {
    fn message(&self, name: Naming) -> String {
        match self {
            Self::Elsewhere => format!(
                "a recipe that completes readings knows them at its own directions only; {} meta \
                 takes recipes of {} joint or paper",
                name(Setting::Method),
                name(Setting::Schedule)
            ),
            Self::Readings => format!(
                "readings are lost, or noisy, where a recipe is scanned by: give {}",
                name(Setting::Recipe)
            ),
            Self::NeedsAll => format!(
                "the recipe needs all of its readings: train one with {} of 0.5 for scans that lose \
                 some",
                name(Setting::Missing)
            ),
            other => other.to_string(),
        }
    }
}

/// Materials, their values and their spheres: all that fits are compared with.
pub struct Evaluator<'a> {
    materials: &'a [Box<dyn Material>],
    at: Vec<HalfDifference<f32>>,
    environment: Environment,
    references: Vec<Reference>,
}

struct Reference {
    values: Vec<[f32; 3]>,
    sphere: Picture,
}

/// A material's name and how well it was fitted.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MaterialMetrics {
    /// Its name.
    pub name: String,
    /// Its scores, averaged over the seeds.
    #[serde(flatten)]
    pub scores: Metrics,
    /// The loss that its fit was likely to have, by its readings, where the recipe predicts one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_loss: Option<f64>,
}

/// How well a method does.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Report {
    /// The method.
    pub method: &'static str,
    /// The model.
    pub model: &'static str,
    /// n.
    pub samples: usize,
    /// Means over the materials.
    #[serde(flatten)]
    pub scores: Metrics,
    /// Standard error of the mean loss, over the materials; None of one.
    pub loss_standard_error: Option<f64>,
    /// How many seeds were averaged over.
    pub seeds: u64,
    /// Standard deviation of the mean loss from seed to seed.
    pub loss_spread: f64,
    /// Each material.
    pub materials: Vec<MaterialMetrics>,
}

impl Report {
    /// The loss of each material.
    #[must_use]
    pub fn losses(&self) -> Vec<f64> {
        let losses = self.materials.iter().map(|each| each.scores.loss);
        losses.collect()
    }

    /// The loss that each material's fit was likely to have, if the recipe predicts it.
    #[must_use]
    pub fn predicted_losses(&self) -> Option<Vec<f64>> {
        let predicted = self.materials.iter().map(|each| each.predicted_loss);
        predicted.collect()
    }
}

impl<'a> Evaluator<'a> {
    /// Evaluates and renders the materials in the built-in studio.
    #[must_use]
    pub fn new(materials: &'a [Box<dyn Material>]) -> Self {
        Self::under(Environment::studio(), materials)
    }

    /// The same under another environment.
    #[must_use]
    pub fn under(environment: Environment, materials: &'a [Box<dyn Material>]) -> Self {
        let at = loss_directions();
        let references = materials
            .par_iter()
            .map(|material| {
                let mut values = vec![[0.0; 3]; at.len()];
                material.brdf_batch(&at, &mut values);
                let sphere = render_sphere(&**material, &environment, SPHERE).tone_map();
                Reference { values, sphere }
            })
            .collect();
        Self {
            materials,
            at,
            environment,
            references,
        }
    }

    /// The materials.
    #[must_use]
    pub fn materials(&self) -> &'a [Box<dyn Material>] {
        self.materials
    }

    /// The rendered sphere of a material.
    #[must_use]
    pub fn reference(&self, material: usize) -> &Picture {
        &self.references[material].sphere
    }

    /// Renders a fit.
    #[must_use]
    pub fn render(&self, fitted: &Fitted) -> Picture {
        render_sphere(fitted, &self.environment, SPHERE).tone_map()
    }

    /// Compares a fit of a material with it.
    ///
    /// # Errors
    /// None in practice: all pictures have the same size.
    pub fn score(
        &self,
        material: usize,
        fitted: &Fitted,
    ) -> Result<(Metrics, Picture), CompareError> {
        let reference = &self.references[material];
        let loss = mean_log_error(fitted, &self.at, &reference.values);
        let sphere = self.render(fitted);
        let scores = Metrics::of_spheres(loss, &reference.sphere, &sphere)?;
        Ok((scores, sphere))
    }

    /// Fits every material by a method, with so many seeds if it is random, and compares.
    ///
    /// # Errors
    /// [`EvaluationError::Ridge`]
    pub fn judge(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
    ) -> Result<Report, EvaluationError> {
        self.evaluate_with_progress(method, seed, seeds, &|| {}, &AtomicBool::new(false))
    }

    /// The same, and calls `done` after every material, from whichever thread has judged it; no other fit is
    /// begun once `stop` is set.
    ///
    /// # Errors
    /// [`EvaluationError::Ridge`], [`EvaluationError::Stopped`]
    pub fn evaluate_with_progress(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
        done: &(dyn Fn() + Sync),
        stop: &AtomicBool,
    ) -> Result<Report, EvaluationError> {
        let seeds = if method.is_random() { seeds.max(1) } else { 1 };
        let all: Vec<Vec<(Metrics, Option<f64>)>> = (0..self.materials.len())
            .into_par_iter()
            .map(|material| {
                let scores = (0..seeds)
                    .map(|offset| {
                        if stop.load(Ordering::Relaxed) {
                            return Err(EvaluationError::Stopped);
                        }
                        // Each material and each repetition draws samples of its own.
                        let seed = seed.wrapping_add((offset << 32) | material as u64);
                        let (fitted, predicted) =
                            method.fit_and_predict(&*self.materials[material], seed)?;
                        let (scores, _) = self.score(material, &fitted)?;
                        Ok((scores, predicted.map(f64::from)))
                    })
                    .collect();
                done();
                scores
            })
            .collect::<Result<_, EvaluationError>>()?;
        let materials: Vec<MaterialMetrics> = self
            .materials
            .iter()
            .zip(&all)
            .map(|(material, scores)| MaterialMetrics {
                name: material.name().to_owned(),
                scores: Metrics::of_repetitions(scores.iter().map(|(scores, _)| *scores))
                    .unwrap_or_default(),
                predicted_loss: scores
                    .iter()
                    .map(|(_, predicted)| *predicted)
                    .sum::<Option<f64>>()
                    .map(|sum| sum / scores.len() as f64),
            })
            .collect();
        let by_seed: Vec<f64> = (0..seeds as usize)
            .map(|seed| {
                all.iter().map(|scores| scores[seed].0.loss).sum::<f64>() / all.len() as f64
            })
            .collect();
        let losses: Vec<f64> = materials.iter().map(|each| each.scores.loss).collect();
        Ok(Report {
            loss_standard_error: Estimate::of(&losses).standard_error,
            method: method.name(),
            model: method.model().name(),
            samples: method.samples(),
            scores: Metrics::mean(materials.iter().map(|each| each.scores)).unwrap_or_default(),
            seeds,
            loss_spread: deviation(&by_seed),
            materials,
        })
    }
}

/// Standard deviation of a sample; 0 of a single number.
fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len().max(2) - 1) as f64).sqrt()
}
