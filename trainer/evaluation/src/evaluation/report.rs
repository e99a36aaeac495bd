//! The report of a method on materials.

use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::{Identity, Material};
use glimpse_training::loss_predictor::rank_correlation;
use serde::{Deserialize, Serialize};

use super::estimate::Estimate;
use super::leakage::TrainingOverlap;
use super::method::Method;
use super::outcome::Forecast;
use crate::metrics::Metrics;

/// The metrics of one material's fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialMetrics {
    /// The name of the material.
    pub name: String,
    /// The metrics, averaged over the seeds.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// The loss that the recipe predicts from the readings, averaged over the seeds; None if it cannot predict one.
    pub predicted_loss: Option<f64>,
    /// The upper bound of the loss for 90 % of materials, averaged over the seeds; None if the recipe has none.
    pub loss_bound: Option<f64>,
    /// The share of directions at which the material is within one predicted standard deviation of the fit, averaged over
    /// the seeds; None if it is unknown.
    pub coverage: Option<f64>,
    /// True if the readings are unlike those of all training materials, for at least half of the seeds; None if the
    /// recipe cannot tell.
    pub unlike_training: Option<bool>,
    /// The overlap with the recipe's training materials; None if they are unknown.
    pub overlap: Option<TrainingOverlap>,
}

/// The losses that a recipe predicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictionQuality {
    /// The mean over the materials.
    pub loss: f64,
    /// The rank correlation of predicted and true losses.
    pub rank_correlation: Option<f64>,
    /// The share of materials whose loss does not exceed its upper bound; None if the recipe has no bounds.
    pub bound_coverage: Option<f64>,
    /// The share of directions at which materials are within one predicted standard deviation of the fit; None if it is
    /// unknown.
    pub coverage: Option<f64>,
}

/// The loss on unseen materials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnseenLoss {
    /// The number of materials.
    pub materials: usize,
    /// The mean loss.
    pub loss: f64,
    /// The standard error of the mean loss.
    pub loss_standard_error: Option<f64>,
}

/// The metrics of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvaluationReport {
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
    /// The predicted losses; None if the recipe does not predict them.
    pub prediction: Option<PredictionQuality>,
    /// The names of training materials of the recipe among the materials; None if the training materials are unknown.
    pub trained_on: Option<Vec<String>>,
    /// The names of materials that only share their name with a training material.
    pub namesakes_trained_on: Option<Vec<String>>,
    /// The loss on unseen materials; None if all materials, or none, are unseen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub new: Option<UnseenLoss>,
    /// The metrics of each material.
    pub materials: Vec<MaterialMetrics>,
}

/// The result of one fit of a material.
pub(super) struct FitMetrics {
    pub(super) metrics: Metrics,
    pub(super) forecast: Forecast,
}

impl MaterialMetrics {
    /// Averages fits with several seeds.
    pub(super) fn new(name: &str, fits: &[FitMetrics]) -> Self {
        let predicted = |value: fn(&LossPrediction) -> Option<f32>| {
            let value = |fit: &FitMetrics| value(fit.forecast.prediction.as_ref()?).map(f64::from);
            mean(fits.iter().map(value))
        };
        Self {
            name: name.to_owned(),
            metrics: Metrics::mean_of_repetitions(fits.iter().map(|fit| fit.metrics))
                .unwrap_or_default(),
            predicted_loss: predicted(|prediction| Some(prediction.loss)),
            loss_bound: predicted(|prediction| prediction.bound),
            coverage: mean(fits.iter().map(|fit| fit.forecast.coverage)),
            unlike_training: predicted(|prediction| prediction.unlike_training.map(f32::from))
                .map(|share| share >= 0.5),
            overlap: None,
        }
    }
}

impl EvaluationReport {
    /// Summarizes the fits of each material, one for each seed.
    pub(super) fn new(method: &Method<'_>, names: &[&str], fits: &[Vec<FitMetrics>]) -> Self {
        let of_names = names.iter().zip(fits);
        let materials: Vec<MaterialMetrics> = of_names
            .map(|(name, fits)| MaterialMetrics::new(name, fits))
            .collect();
        let seeds = fits.first().map_or(0, Vec::len);
        let of_seed = |seed: usize| fits.iter().map(move |fits| fits[seed].metrics.loss);
        let mean_losses_by_seed: Vec<f64> = (0..seeds)
            .map(|seed| of_seed(seed).sum::<f64>() / fits.len() as f64)
            .collect();
        let losses: Vec<f64> = materials.iter().map(|each| each.metrics.loss).collect();
        Self {
            method: method.name.into(),
            model: method.model.name().into(),
            samples: method.samples(),
            metrics: Metrics::mean(materials.iter().map(|material| material.metrics))
                .unwrap_or_default(),
            loss_standard_error: Estimate::from_values(&losses).standard_error,
            seconds: mean(fits.iter().flatten().map(|fit| fit.forecast.seconds)),
            seeds: seeds as u64,
            loss_spread: standard_deviation(&mean_losses_by_seed),
            prediction: PredictionQuality::new(&materials, &losses),
            trained_on: None,
            namesakes_trained_on: None,
            new: None,
            materials,
        }
    }

    /// Marks the materials that the recipe was trained on, unless its training materials are unknown.
    #[must_use]
    pub fn with_overlaps(
        mut self,
        trained_on: &[Identity],
        materials: &[Box<dyn Material>],
    ) -> Self {
        if trained_on.is_empty() {
            return self;
        }
        for (metrics, material) in self.materials.iter_mut().zip(materials) {
            metrics.overlap = TrainingOverlap::of(&**material, trained_on);
        }
        let of_kind = |kind: TrainingOverlap| {
            let materials = self.materials.iter();
            materials.filter(move |material| material.overlap == Some(kind))
        };
        let names = |kind| Some(of_kind(kind).map(|each| each.name.clone()).collect());
        self.trained_on = names(TrainingOverlap::SameBrdf);
        self.namesakes_trained_on = names(TrainingOverlap::SameName);
        let unseen = of_kind(TrainingOverlap::Unseen).map(|material| material.metrics.loss);
        let unseen: Vec<f64> = unseen.collect();
        let estimate = Estimate::from_values(&unseen);
        self.new = (1..self.materials.len())
            .contains(&unseen.len())
            .then_some(UnseenLoss {
                materials: unseen.len(),
                loss: estimate.mean,
                loss_standard_error: estimate.standard_error,
            });
        self
    }

    /// Returns the loss of each material.
    #[must_use]
    pub fn losses(&self) -> Vec<f64> {
        let losses = self.materials.iter().map(|material| material.metrics.loss);
        losses.collect()
    }
}

impl PredictionQuality {
    fn new(materials: &[MaterialMetrics], losses: &[f64]) -> Option<Self> {
        let predicted = materials.iter().map(|material| material.predicted_loss);
        let predicted: Vec<f64> = predicted.collect::<Option<_>>()?;
        let holds = |each: &MaterialMetrics| Some((each.metrics.loss <= each.loss_bound?).into());
        Some(Self {
            coverage: mean(materials.iter().map(|material| material.coverage)),
            loss: Estimate::from_values(&predicted).mean,
            rank_correlation: rank_correlation(&predicted, losses),
            bound_coverage: mean(materials.iter().map(holds)),
        })
    }
}

/// Returns the mean of all values; None if one is unknown.
fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values: Vec<f64> = values.collect::<Option<_>>()?;
    Some(Estimate::from_values(&values).mean)
}

/// Returns the sample standard deviation; 0 for a single value.
fn standard_deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum_of_squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (sum_of_squares / (values.len().max(2) - 1) as f64).sqrt()
}
