//! Scans that end as soon as the upper bound of the loss is at most a target.

use glimpse_core::recipe::Recipe;
use glimpse_fitting::recipe::Metadata;
use glimpse_fitting::route::{Order, Route};
use glimpse_kernels::scan::scan_with_missing;
use rayon::prelude::*;

use super::EvaluationError;
use super::evaluator::Evaluator;
use super::method::Method;
use super::reader::Degradation;

/// The scan of one material.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct TargetScan {
    /// The name of the material.
    pub name: String,
    /// The number of readings.
    pub readings: usize,
    /// The time until the last reading, in seconds.
    pub seconds: f64,
    /// True if the scan ended before its last sample.
    pub ended_early: bool,
    /// The upper bound of the loss after the last reading; None if it overflows.
    pub loss_bound: Option<f32>,
    /// The loss.
    pub loss: f64,
}

/// Scans that end as soon as the upper bound of the loss is at most a target.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct TargetReport {
    /// The target.
    pub target: f64,
    /// The number of samples of the recipe.
    pub samples: usize,
    /// The time of a scan of all samples in the recipe's order in seconds, on the machine that the recipe was trained for, or
    /// else on the default one.
    pub plan_seconds: f64,
    /// The mean number of readings.
    pub readings: f64,
    /// The mean time of a scan, in seconds.
    pub seconds: f64,
    /// The share of scans that ended early.
    pub early_share: f64,
    /// The mean time of the scans that ended early, in seconds; None if none did.
    pub early_seconds: Option<f64>,
    /// The share of these scans whose loss is at most the target.
    pub early_held: Option<f64>,
    /// The scans.
    pub scans: Vec<TargetScan>,
}

impl Evaluator<'_> {
    /// Scans each material in the recipe's order until the upper bound of its loss is at most `target`.
    ///
    /// `method` is [`Method::with_recipe`] of `recipe`. Its degradation must not have missing readings.
    ///
    /// # Errors
    /// [`EvaluationError::NoPartialBound`] if the recipe has no bounds for scans that end early,
    /// [`EvaluationError::Unreachable`] if it exceeds its own limits, and the errors of a fit of all readings.
    pub fn evaluate_target(
        &self,
        recipe: &Recipe<'_>,
        method: &Method<'_>,
        target: f64,
        seed: u64,
    ) -> Result<TargetReport, EvaluationError> {
        if !recipe.bounds_partial_loss() {
            return Err(EvaluationError::NoPartialBound);
        }
        let route = Metadata::of(recipe)
            .ok()
            .and_then(|metadata| Route::of_recipe(recipe, &metadata.machine(), Order::Progressive));
        let route = route.ok_or(EvaluationError::Unreachable)?;
        let samples = recipe.samples();
        let prefix = |count: usize| Degradation {
            first: Some(count),
            ..method.degradation
        };
        let scan = |index: usize| {
            let material = &*self.materials[index];
            let seed = seed.wrapping_add(index as u64);
            let reaches_target = |count: &usize| {
                let mut reader = prefix(*count).reader(material, samples, seed);
                let mut read = |index: u16, angles| reader.read(index.into(), angles);
                // A device continues if the fit fails, is implausible, or has no bound.
                scan_with_missing(recipe, &mut read).is_ok_and(|outcome| {
                    let bound = outcome.prediction.and_then(|prediction| prediction.bound);
                    let is_low = bound.is_some_and(|bound| f64::from(bound) <= target);
                    is_low && outcome.residual.implausible.is_none()
                })
            };
            let count = (1..samples).find(reaches_target).unwrap_or(samples);
            let outcome = method.fit_degraded(&prefix(count), material, seed)?;
            Ok(TargetScan {
                name: material.name().to_owned(),
                readings: count,
                seconds: route.visits[count - 1].seconds,
                ended_early: count < samples,
                loss_bound: outcome
                    .forecast
                    .prediction
                    .and_then(|prediction| prediction.bound),
                loss: self.loss(index, &*outcome.fitted),
            })
        };
        let scans = (0..self.materials.len()).into_par_iter().map(scan);
        let scans = scans.collect::<Result<Vec<TargetScan>, EvaluationError>>()?;
        let early: Vec<&TargetScan> = scans.iter().filter(|scan| scan.ended_early).collect();
        let mean = |list: &[&TargetScan], value: &dyn Fn(&TargetScan) -> f64| {
            let sum: f64 = list.iter().map(|scan| value(scan)).sum();
            (!list.is_empty()).then(|| sum / list.len() as f64)
        };
        let all: Vec<&TargetScan> = scans.iter().collect();
        Ok(TargetReport {
            target,
            samples,
            plan_seconds: route.total(),
            readings: mean(&all, &|scan| scan.readings as f64).unwrap_or(0.0),
            seconds: mean(&all, &|scan| scan.seconds).unwrap_or(0.0),
            early_share: mean(&all, &|scan| scan.ended_early.into()).unwrap_or(0.0),
            early_seconds: mean(&early, &|scan| scan.seconds),
            early_held: mean(&early, &|scan| (scan.loss <= target).into()),
            scans,
        })
    }
}
