//! The methods: where they measure, and how they fit.

use glimpse_core::fit::{Algorithm, Channels};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, ModelKind, Sample, Samples, Slot, slot_of};
use glimpse_core::recipe::{Descent, FitMethod, Recipe};
use glimpse_kernels::scan::scan_some;
use glimpse_kernels::with_model;
use glimpse_materials::basis::{Basis, Coefficients};
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Fitted, Material};
use glimpse_training::linear::Reduced;

use super::EvaluationError;
use super::adam;
use super::readings::Readings;

/// Where a method measures.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Places {
    /// At these angles, in radians.
    Pattern(Vec<Angles<f32>>),
    /// At so many uniform valid directions, drawn anew for each material and seed.
    Random(usize),
    /// At so many uniform valid directions that more would change nothing, or, where it draws them
    /// as it fits, at none.
    Plenty(usize),
}

/// How a method fits what it has measured.
#[derive(Clone, Debug)]
enum Fitting<'a> {
    /// A scan by a recipe, as on the device; Linear with the recipe's basis.
    Scan(Box<Recipe<'a>>, Option<&'a Basis>),
    /// A recipe's descent, at any directions.
    DescentAnywhere(Descent<'a>),
    /// A ridge solve with these precisions, at any directions.
    RidgeAnywhere(Vec<f64>, &'a Basis),
    /// Adam from a random start, so many steps.
    Adam(ModelKind, usize),
    /// So many steps of Adam, enough that more gain nothing, with fresh samples at each.
    Optimum(ModelKind, usize),
}

/// How samples of a material become a fit.
#[derive(Clone, Debug)]
pub struct Method<'a> {
    name: &'static str,
    places: Places,
    fitting: Fitting<'a>,
    /// Steps of Adam on fresh samples after the fit.
    steps_after: usize,
    /// What coefficients of the model Linear become a BRDF by, if it is not the whole basis.
    compact: Option<&'a Basis>,
    /// What becomes of a recipe's readings.
    readings: Readings,
}

/// Directions that the method Optimum solves the Linear model at.
const LINEAR_OPTIMUM: usize = 8_192;

impl<'a> Method<'a> {
    /// A recipe's pattern, and its way to fit. Linear needs the basis of the recipe.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn ours(recipe: &Recipe<'a>, basis: Option<&'a Basis>) -> Result<Self, EvaluationError> {
        if recipe.model() == ModelKind::Linear && basis.is_none() {
            return Err(EvaluationError::Basis);
        }
        Ok(Self {
            name: match recipe.completed() {
                Some(_) => "completed",
                None => "ours",
            },
            places: Places::Pattern(recipe.pattern().collect()),
            fitting: Fitting::Scan(Box::new(*recipe), basis),
            steps_after: 0,
            compact: None,
            readings: Readings::default(),
        })
    }

    /// A recipe's way to fit (start and step sizes, or precisions), at as many random directions.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn meta(recipe: &Recipe<'a>, basis: Option<&'a Basis>) -> Result<Self, EvaluationError> {
        let places = Places::Random(recipe.samples());
        Self::at_places("meta", recipe, basis, places)
    }

    /// A recipe's way to fit at other directions than its own, under a name.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn elsewhere(
        name: &'static str,
        recipe: &Recipe<'a>,
        basis: Option<&'a Basis>,
        pattern: Vec<Angles<f32>>,
    ) -> Result<Self, EvaluationError> {
        Self::at_places(name, recipe, basis, Places::Pattern(pattern))
    }

    fn at_places(
        name: &'static str,
        recipe: &Recipe<'a>,
        basis: Option<&'a Basis>,
        places: Places,
    ) -> Result<Self, EvaluationError> {
        let fitting = match (recipe.method(), basis) {
            (FitMethod::Descent(descent), _) => Fitting::DescentAnywhere(descent),
            // The recipe's reduced basis is of its own directions.
            (FitMethod::Ridge(ridge), Some(basis)) => {
                let precision = ridge.precision().iter().map(f64::from).collect();
                Fitting::RidgeAnywhere(precision, basis)
            }
            (FitMethod::Ridge(_), None) => return Err(EvaluationError::Basis),
            (FitMethod::Completed(_), _) => return Err(EvaluationError::Elsewhere),
        };
        Ok(Self {
            name,
            places,
            fitting,
            steps_after: 0,
            compact: None,
            readings: Readings::default(),
        })
    }

    /// The same, and then so many steps of Adam, at 1e-3, on 512 fresh samples each. (A solve in
    /// closed form, as Linear's, is left as it is.)
    #[must_use]
    pub fn then_steps(self, steps_after: usize) -> Self {
        Self {
            steps_after,
            ..self
        }
    }

    /// The same, but coefficients become a BRDF by another basis that the recipe names: a compact one, as on a
    /// device.
    ///
    /// # Errors
    /// [`EvaluationError::Compact`]
    pub fn by_compact(self, compact: &'a Basis) -> Result<Self, EvaluationError> {
        let of = match &self.fitting {
            Fitting::Scan(_, basis) => basis.map(Basis::named_by),
            Fitting::RidgeAnywhere(_, basis) => Some(basis.named_by()),
            _ => None,
        };
        if of != Some(compact.named_by()) {
            return Err(EvaluationError::Compact);
        }
        Ok(Self {
            compact: Some(compact),
            ..self
        })
    }

    /// The same, from readings that are noisy, or some of them missing.
    ///
    /// # Errors
    /// [`EvaluationError::Readings`] if it is no scan by a recipe, [`EvaluationError::NeedsAll`] if its recipe
    /// cannot do without some, [`EvaluationError::FewerReadings`] if it has not as many.
    pub fn with_readings(self, readings: Readings) -> Result<Self, EvaluationError> {
        let Fitting::Scan(recipe, _) = &self.fitting else {
            return Err(EvaluationError::Readings);
        };
        if readings.are_missing() && !recipe.tolerates_missing() {
            return Err(EvaluationError::NeedsAll);
        }
        let samples = recipe.samples();
        if let Some(first) = readings.first.filter(|first| *first > samples) {
            return Err(EvaluationError::FewerReadings { first, samples });
        }
        Ok(Self { readings, ..self })
    }

    fn reconstruct(&self, basis: &Basis, coefficients: &Coefficients) -> Fitted {
        Fitted::linear(self.compact.unwrap_or(basis), coefficients)
    }

    /// Adam from a random start on random samples.
    #[must_use]
    pub fn random(model: ModelKind, samples: usize, steps: usize) -> Self {
        Self {
            name: "random",
            places: Places::Random(samples),
            fitting: Fitting::Adam(model, steps),
            steps_after: 0,
            compact: None,
            readings: Readings::default(),
        }
    }

    /// The best that a model fitted by descent can do: found in [`OPTIMUM_STEPS`](super::OPTIMUM_STEPS), or
    /// nearly so in fewer.
    #[must_use]
    pub fn optimum(model: ModelKind, steps: usize) -> Self {
        Self {
            name: "optimum",
            places: Places::Plenty(0),
            fitting: Fitting::Optimum(model, steps),
            steps_after: 0,
            compact: None,
            readings: Readings::default(),
        }
    }

    /// The model Linear with the same precision for all coefficients, on random samples.
    #[must_use]
    pub fn linear_random(basis: &'a Basis, eta: f64, samples: usize) -> Self {
        Self::linear("random", basis, eta, Places::Random(samples))
    }

    /// The same on samples that make the problem well conditioned (Nielsen et al. 2015).
    #[must_use]
    pub fn linear_njr15(basis: &'a Basis, eta: f64, pattern: Vec<Angles<f32>>) -> Self {
        Self::linear("njr15", basis, eta, Places::Pattern(pattern))
    }

    /// The same on so many samples that more would change nothing.
    #[must_use]
    pub fn linear_optimum(basis: &'a Basis, eta: f64) -> Self {
        Self::linear("optimum", basis, eta, Places::Plenty(LINEAR_OPTIMUM))
    }

    fn linear(name: &'static str, basis: &'a Basis, eta: f64, places: Places) -> Self {
        Self {
            name,
            places,
            fitting: Fitting::RidgeAnywhere(vec![eta; basis.components()], basis),
            steps_after: 0,
            compact: None,
            readings: Readings::default(),
        }
    }

    /// The name on the command line and in tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match &self.fitting {
            Fitting::Scan(recipe, _) => recipe.model(),
            Fitting::DescentAnywhere(descent) => descent.model(),
            Fitting::RidgeAnywhere(..) => ModelKind::Linear,
            Fitting::Adam(model, _) | Fitting::Optimum(model, _) => *model,
        }
    }

    /// n; 0 stands for the method Optimum's, as many as it takes.
    #[must_use]
    pub fn samples(&self) -> usize {
        match &self.places {
            Places::Pattern(pattern) => pattern.len(),
            Places::Random(samples) => *samples,
            Places::Plenty(_) => 0,
        }
    }

    /// Where it measures, if that is the same for all materials; else empty.
    #[must_use]
    pub fn pattern(&self) -> &[Angles<f32>] {
        match &self.places {
            Places::Pattern(pattern) => pattern,
            Places::Random(_) | Places::Plenty(_) => &[],
        }
    }

    /// True if the outcome depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        matches!(self.places, Places::Random(_)) || self.readings.are_random()
    }

    /// Fits a material; what a recipe says is done as on the device: in f32, by core's own code.
    ///
    /// # Errors
    /// [`EvaluationError::Ridge`]
    pub fn fit(&self, material: &dyn Material, seed: u64) -> Result<Fitted, EvaluationError> {
        Ok(self.fit_and_predict(material, seed)?.0)
    }

    /// The same, and the loss that the fit is likely to have, where a recipe predicts one.
    ///
    /// # Errors
    /// [`EvaluationError::Ridge`]
    pub fn fit_and_predict(
        &self,
        material: &dyn Material,
        seed: u64,
    ) -> Result<(Fitted, Option<f32>), EvaluationError> {
        let mut predicted = None;
        let fitted = self.fit_telling(material, seed, &mut predicted)?;
        Ok((fitted, predicted))
    }

    fn fit_telling(
        &self,
        material: &dyn Material,
        seed: u64,
        predicted: &mut Option<f32>,
    ) -> Result<Fitted, EvaluationError> {
        let drawn;
        let angles = match &self.places {
            Places::Pattern(pattern) => pattern,
            Places::Random(samples) | Places::Plenty(samples) => {
                drawn = uniform_valid(*samples, seed);
                &drawn
            }
        };
        let parameters = match &self.fitting {
            Fitting::Scan(recipe, basis) => {
                let mut read = self.readings.of(material, recipe.samples(), seed);
                let found = scan_some(recipe, &mut read)?;
                *predicted = found.predicted_loss;
                match (recipe.model(), basis) {
                    (ModelKind::Linear, Some(basis)) => {
                        let coefficients = basis.channels(&found.values)?;
                        return Ok(self.reconstruct(basis, &coefficients));
                    }
                    _ => found.values,
                }
            }
            Fitting::RidgeAnywhere(precision, basis) => {
                let places: Vec<Angles<f64>> = angles
                    .iter()
                    .map(glimpse_materials::basis::widened)
                    .collect();
                let measured: Vec<[f32; 3]> =
                    angles.iter().map(|angles| material.brdf(*angles)).collect();
                let coefficients = Reduced::new(basis, &places).fit(precision, &measured)?;
                return Ok(self.reconstruct(basis, &coefficients));
            }
            Fitting::DescentAnywhere(descent) => with_model!(
                self.model(), M => learn::<M>(*descent, &measure(material, angles)),
                _ => Vec::new()
            ),
            Fitting::Adam(model, steps) => with_model!(
                *model, M => adam::random::<M>(&measure(material, angles), *steps, seed),
                _ => Vec::new()
            ),
            Fitting::Optimum(model, steps) => with_model!(
                *model, M => adam::optimum::<M>(material, *steps, seed), _ => Vec::new()
            ),
        };
        let parameters = match self.steps_after {
            0 => parameters,
            steps => with_model!(
                self.model(), M => adam::go_on::<M>(&parameters, material, steps, seed),
                _ => parameters
            ),
        };
        Fitted::new(self.model(), parameters, None).ok_or(EvaluationError::Basis)
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
            measured: material.brdf(*angles),
            weight,
        })
        .collect()
}

/// A recipe's descent at other directions than its own: core's, without a scan.
fn learn<M: Model>(descent: Descent<'_>, samples: &[Sample<f32>]) -> Vec<f32> {
    let method = FitMethod::Descent(descent);
    let mut words = vec![0.0; M::words(&method, samples.len()).unwrap_or_default()];
    M::start(&mut words, &method, Channels::Color);
    let slots: Vec<Slot> = samples
        .iter()
        .map(|sample| slot_of(&sample.at, sample.measured))
        .collect();
    let samples = Samples::new(&slots, 1.0 / (3.0 * samples.len() as f32));
    M::advance(&mut words, &method, samples, Channels::Color, 0, u32::MAX);
    M::values(&words, &method).concat()
}
