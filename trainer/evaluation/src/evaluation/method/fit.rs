//! Fits of a method to one material.

use glimpse_core::fit::{AnyModel, Channels, Estimator, ScanModel, Sgd};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, Sample, Samples, Slot, slot_of};
use glimpse_core::recipe::Recipe;
use glimpse_fitting::linear::{ComponentsAt, Posterior, PosteriorReading};
use glimpse_kernels::ModelKernels;
use glimpse_kernels::scan::{LossPrediction, ScanOutcome, scan_with_missing};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{FittedBrdf, Material};

use super::super::ggx::Ggx;
use super::super::{EvaluationError, adam};
use super::{FitAlgorithm, Fitted, Method, Outcome, SampleDirections};

impl Method<'_> {
    /// Fits a material. Recipes run as on a device: in f32, with the code of glimpse-core.
    ///
    /// # Errors
    /// [`EvaluationError::Scan`] or [`EvaluationError::Count`].
    pub fn fit(&self, material: &dyn Material, seed: u64) -> Result<Fitted, EvaluationError> {
        Ok(self.fit_and_predict(material, seed)?.fitted)
    }

    /// Scans a material with the method's recipe, and its degradation of readings.
    pub(in crate::evaluation) fn scan(
        &self,
        recipe: &Recipe<'_>,
        material: &dyn Material,
        seed: u64,
    ) -> Result<ScanOutcome, glimpse_core::error::Error> {
        let mut read = self.degradation.reader(material, recipe.samples(), seed);
        scan_with_missing(recipe, &mut |index, angles| {
            read(index, self.measured(index, angles))
        })
    }

    /// Returns the real direction of a sample.
    fn measured(&self, index: u16, angles: Angles<f32>) -> Angles<f32> {
        let measured = self
            .measured
            .as_ref()
            .and_then(|all| all.get(usize::from(index)));
        measured.copied().unwrap_or(angles)
    }

    /// Predicts the loss of a fit by the prior, if the method has one.
    fn prediction(
        &self,
        material: &dyn Material,
        seed: u64,
        fitted: &FittedBrdf,
    ) -> Option<LossPrediction> {
        let (prior, pattern) = (self.prior.as_ref()?, self.pattern());
        if !matches!(self.algorithm, FitAlgorithm::Scan(..)) {
            return None;
        }
        let mut read = self.degradation.reader(material, pattern.len(), seed);
        let readings = (0..).zip(pattern).filter_map(|(index, angles)| {
            let brdf = read(index, self.measured(index, *angles))?;
            Some(PosteriorReading::new(*angles, brdf))
        });
        Some(Posterior::new(prior, &readings.collect::<Vec<_>>())?.loss(fitted))
    }

    /// Fits a material, and predicts the loss.
    ///
    /// # Errors
    /// [`EvaluationError::Scan`] or [`EvaluationError::Count`].
    pub fn fit_and_predict(
        &self,
        material: &dyn Material,
        seed: u64,
    ) -> Result<Outcome, EvaluationError> {
        let mut prediction = None;
        let mut adaptive_scan = None;
        let drawn;
        let angles: &[Angles<f32>] = match &self.directions {
            SampleDirections::Pattern(pattern) => pattern,
            SampleDirections::Chosen(_) => &[],
            SampleDirections::Random(samples) | SampleDirections::Converged(samples) => {
                drawn = uniform_valid(*samples, seed);
                &drawn
            }
        };
        let parameters = match &self.algorithm {
            FitAlgorithm::Scan(recipe, _) => {
                let result = self.scan(recipe, material, seed)?;
                prediction = result.prediction;
                result.values
            }
            FitAlgorithm::Adaptive(adaptive) => {
                let mut read = self.degradation.reader(material, adaptive.samples(), seed);
                let scan = adaptive.scan(&mut read)?;
                let values = scan.outcome.values.clone();
                adaptive_scan = Some(scan);
                values
            }
            FitAlgorithm::Ggx => {
                let mut read = self.degradation.reader(material, angles.len(), seed);
                let readings = (0..).zip(angles);
                let readings =
                    readings.map(|(index, angles)| read(index, self.measured(index, *angles)));
                let readings: Vec<[f32; 3]> = readings.flatten().collect();
                return Ok(Outcome {
                    fitted: Fitted::Ggx(Ggx::fit(angles, &readings)),
                    prediction: None,
                    seconds: None,
                });
            }
            FitAlgorithm::RidgeAnywhere(precision, basis) => {
                let measured: Vec<[f32; 3]> = angles
                    .iter()
                    .map(|angles| material.at_angles(*angles))
                    .collect();
                ComponentsAt::new(basis, angles.to_vec()).fit(precision, &measured)
            }
            FitAlgorithm::SgdAnywhere(sgd) => descend(*sgd, &measure(material, angles)),
            FitAlgorithm::Adam(model, steps) => ModelKernels::of(*model)
                .map(|kernels| adam::random(kernels, &measure(material, angles), *steps, seed))
                .unwrap_or_default(),
            FitAlgorithm::Optimum(model, steps) => ModelKernels::of(*model)
                .map(|kernels| adam::optimum(kernels, material, *steps, seed))
                .unwrap_or_default(),
        };
        let parameters = match (self.refinement_steps, ModelKernels::of(self.model())) {
            (0, _) | (_, None) => parameters,
            (steps, Some(kernels)) => adam::refine(kernels, parameters, material, steps, seed),
        };
        let basis = self.basis();
        if let (ModelKind::Linear, Some(basis)) = (self.model(), basis) {
            basis.channels(&parameters)?;
        }
        let fitted = FittedBrdf::new(self.model(), parameters, self.compact.or(basis));
        let fitted = fitted.ok_or(EvaluationError::Basis)?;
        let prediction = match &adaptive_scan {
            Some(scan) => Some(scan.posterior.loss(&fitted)),
            None => prediction.or_else(|| self.prediction(material, seed, &fitted)),
        };
        Ok(Outcome {
            fitted: Fitted::Model(fitted),
            prediction,
            seconds: adaptive_scan.and_then(|scan| scan.seconds),
        })
    }
}

/// Measures a material at some directions.
#[must_use]
pub fn measure(material: &dyn Material, angles: &[Angles<f32>]) -> Vec<Sample<f32>> {
    let weight = 1.0 / (3.0 * angles.len() as f32);
    angles
        .iter()
        .map(|angles| Sample {
            at: HalfDifference::from_angles(*angles),
            measured: material.at_angles(*angles),
            weight,
        })
        .collect()
}

/// Runs a recipe's SGD at other directions than its own, with the code of glimpse-core but without a scan.
fn descend(sgd: Sgd<'_>, samples: &[Sample<f32>]) -> Vec<f32> {
    let Ok(functions) = AnyModel::functions(sgd.model) else {
        return Vec::new();
    };
    let estimator = Estimator::Sgd(sgd);
    let mut words = vec![0.0; estimator.words(samples.len())];
    estimator.start(&mut words, Channels::Color);
    let slots: Vec<Slot> = samples
        .iter()
        .map(|sample| slot_of(&sample.at, sample.measured))
        .collect();
    let inputs = (
        Samples::new(&slots, 1.0 / (3.0 * samples.len() as f32)),
        Channels::Color,
    );
    estimator.advance(
        functions,
        &mut words,
        inputs,
        0,
        estimator.units(samples.len()),
    );
    estimator.values_of(&words).concat()
}
