//! Methods: the directions that they measure and the way they fit.

use glimpse_core::fit::{Estimator, Sgd};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::linear::CoefficientPrior;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Brdf, FittedBrdf};

mod fit;

pub use fit::measure;

use super::EvaluationError;
use super::adaptive::Adaptive;
use super::degradation::Degradation;
use super::ggx::Ggx;

/// Names of methods in tables, pictures and reports.
pub mod names {
    /// Random directions, and a fit from a random start.
    pub const RANDOM: &str = "Random";
    /// Random directions, and a learned start (paper).
    pub const META: &str = "Meta";
    /// The directions of Nielsen, Jensen and Ramamoorthi 2015.
    pub const NJR15: &str = "NJR15";
    /// The paper's method: a recipe of schedule `paper`.
    pub const PAPER: &str = "the paper's";
    /// A recipe of schedule `prior`, which completes the readings.
    pub const GLIMPSE: &str = "Glimpse";
    /// A diffuse and a GGX lobe.
    pub const GGX: &str = "GGX";
    /// The best fit with unlimited samples.
    pub const OPTIMUM: &str = "Optimum";
}

/// A fitted BRDF.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // most are models
pub enum Fitted {
    /// One of the four models.
    Model(FittedBrdf),
    /// A diffuse and a GGX lobe.
    Ggx(Ggx),
}

impl Brdf for Fitted {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        match self {
            Self::Model(fitted) => fitted.values_at(at),
            Self::Ggx(ggx) => ggx.values_at(at),
        }
    }
}

/// The result of a method for one material.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The fitted BRDF.
    pub fitted: Fitted,
    /// The predicted loss, if the method has one.
    pub prediction: Option<LossPrediction>,
    /// The time of a scan that chooses directions by seconds, in seconds.
    pub seconds: Option<f64>,
}

/// The directions that a method measures.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleDirections {
    /// These angles, in radians.
    Pattern(Vec<Angles<f32>>),
    /// A number of uniform valid directions, drawn again for each material and seed.
    Random(usize),
    /// A number of directions that a scan chooses.
    Chosen(usize),
    /// A number of uniform valid directions that is large enough for the result to converge. It is 0 if the method
    /// draws directions during the fit.
    Converged(usize),
}

/// The algorithm that fits the measurements.
#[derive(Clone, Debug)]
enum FitAlgorithm<'a> {
    /// A scan with a recipe, as on a device. Linear also needs the recipe's basis.
    Scan(Box<Recipe<'a>>, Option<&'a Basis>),
    /// Scans that choose each direction by the readings so far.
    Adaptive(Box<Adaptive<'a>>),
    /// The recipe's gradient descent, at any directions.
    SgdAnywhere(Sgd<'a>),
    /// Ridge regression with these precisions, at any directions.
    RidgeAnywhere(Vec<f32>, &'a Basis),
    /// A diffuse and a GGX lobe.
    Ggx,
    /// Adam from a random start, with a number of steps.
    Adam(ModelKind, usize),
    /// Adam with fresh samples at each step, with a number of steps at which it has converged.
    Optimum(ModelKind, usize),
}

/// A method: directions to measure a material at, and an algorithm that fits it.
#[derive(Clone, Debug)]
pub struct Method<'a> {
    name: &'static str,
    directions: SampleDirections,
    algorithm: FitAlgorithm<'a>,
    /// The number of Adam steps on fresh samples after the fit.
    refinement_steps: usize,
    /// The compact basis that converts coefficients of the model Linear to a BRDF; None for the whole basis.
    compact: Option<&'a Basis>,
    /// The degradation of a recipe's readings.
    degradation: Degradation,
    /// The directions that the readings really have; None for those of the method.
    measured: Option<Vec<Angles<f32>>>,
    /// The prior of a recipe without a prediction of its own.
    prior: Option<CoefficientPrior>,
}

/// The number of directions at which the method Optimum for the model Linear has converged.
pub const LINEAR_OPTIMUM_DIRECTIONS: usize = 8_192;

impl<'a> Method<'a> {
    fn new(name: &'static str, directions: SampleDirections, algorithm: FitAlgorithm<'a>) -> Self {
        Self {
            name,
            directions,
            algorithm,
            refinement_steps: 0,
            compact: None,
            degradation: Degradation::default(),
            measured: None,
            prior: None,
        }
    }

    /// Creates a scan with a recipe: its pattern and its fit. Linear needs the recipe's basis.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn with_recipe(
        recipe: &Recipe<'a>,
        basis: Option<&'a Basis>,
    ) -> Result<Self, EvaluationError> {
        if recipe.model() == ModelKind::Linear && basis.is_none() {
            return Err(EvaluationError::Basis);
        }
        let name = match recipe.estimator() {
            Estimator::Ridge { coefficients, .. }
                if coefficients.net.is_some() || coefficients.noise.is_some() =>
            {
                names::GLIMPSE
            }
            _ => names::PAPER,
        };
        let pattern = recipe.pattern().collect();
        let algorithm = FitAlgorithm::Scan(Box::new(*recipe), basis);
        Ok(Self::new(
            name,
            SampleDirections::Pattern(pattern),
            algorithm,
        ))
    }

    /// Creates scans that choose each direction by the readings so far.
    #[must_use]
    pub fn adaptive(adaptive: Adaptive<'a>) -> Self {
        let directions = SampleDirections::Chosen(adaptive.samples());
        let algorithm = FitAlgorithm::Adaptive(Box::new(adaptive));
        Self::new(names::GLIMPSE, directions, algorithm)
    }

    /// Creates a recipe's fit (start and step sizes, or precisions) at random directions. Their number is that of the
    /// recipe's pattern.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn meta(recipe: &Recipe<'a>, basis: Option<&'a Basis>) -> Result<Self, EvaluationError> {
        let directions = SampleDirections::Random(recipe.samples());
        Self::with_directions(names::META, recipe, basis, directions)
    }

    /// Creates a recipe's fit at other directions than its own, with a name.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`], [`EvaluationError::OtherDirections`]
    pub fn at_directions(
        name: &'static str,
        recipe: &Recipe<'a>,
        basis: Option<&'a Basis>,
        pattern: Vec<Angles<f32>>,
    ) -> Result<Self, EvaluationError> {
        Self::with_directions(name, recipe, basis, SampleDirections::Pattern(pattern))
    }

    fn with_directions(
        name: &'static str,
        recipe: &Recipe<'a>,
        basis: Option<&'a Basis>,
        directions: SampleDirections,
    ) -> Result<Self, EvaluationError> {
        let algorithm = match (recipe.estimator(), basis) {
            (Estimator::Sgd(sgd), _) => FitAlgorithm::SgdAnywhere(*sgd),
            (estimator, _) if estimator.net().is_some() => {
                return Err(EvaluationError::OtherDirections);
            }
            // The rows in the recipe are only valid at the recipe's own directions.
            (Estimator::Ridge { coefficients, .. }, Some(basis)) => {
                let precision = coefficients.ridge.precision.iter();
                FitAlgorithm::RidgeAnywhere(precision.collect(), basis)
            }
            (Estimator::Ridge { .. }, None) => return Err(EvaluationError::Basis),
        };
        Ok(Self::new(name, directions, algorithm))
    }

    /// Creates a fit of a diffuse and a GGX lobe to readings at these directions.
    #[must_use]
    pub fn ggx(pattern: Vec<Angles<f32>>) -> Self {
        Self::new(
            names::GGX,
            SampleDirections::Pattern(pattern),
            FitAlgorithm::Ggx,
        )
    }

    /// Predicts losses by a prior, if the recipe does not.
    #[must_use]
    pub fn with_prior(self, prior: CoefficientPrior) -> Self {
        Self {
            prior: Some(prior),
            ..self
        }
    }

    /// Reads at other directions than the fit assumes, one for each sample.
    #[must_use]
    pub fn measured_at(self, directions: Vec<Angles<f32>>) -> Self {
        Self {
            measured: Some(directions),
            ..self
        }
    }

    /// Adds steps of Adam after the fit, with a learning rate of 1e-3 and 512 fresh samples each. A closed-form solution,
    /// such as that of Linear, is not refined.
    #[must_use]
    pub fn with_refinement(self, refinement_steps: usize) -> Self {
        Self {
            refinement_steps,
            ..self
        }
    }

    /// Converts coefficients to a BRDF with the recipe's compact basis instead of the whole one, as on a device.
    ///
    /// # Errors
    /// [`EvaluationError::Compact`]
    pub fn with_compact_basis(self, compact: &'a Basis) -> Result<Self, EvaluationError> {
        if self.basis().map(Basis::whole_checksum) != Some(compact.whole_checksum()) {
            return Err(EvaluationError::Compact);
        }
        Ok(Self {
            compact: Some(compact),
            ..self
        })
    }

    /// Degrades the readings of a scan with a recipe.
    ///
    /// # Errors
    /// [`EvaluationError::DegradationWithoutRecipe`] if the method is not a scan with a recipe,
    /// [`EvaluationError::NeedsAllReadings`] if readings are missing and the recipe does not tolerate that,
    /// [`EvaluationError::TooFewReadings`] if the recipe has fewer than `first` samples.
    pub fn with_degradation(self, degradation: Degradation) -> Result<Self, EvaluationError> {
        let recipe = match &self.algorithm {
            FitAlgorithm::Scan(recipe, _) => recipe,
            FitAlgorithm::Ggx | FitAlgorithm::Adaptive(_) => {
                return Ok(Self {
                    degradation,
                    ..self
                });
            }
            _ => return Err(EvaluationError::DegradationWithoutRecipe),
        };
        let has_missing = degradation.first.is_some() || degradation.lost > 0;
        if has_missing && !recipe.tolerates_missing() {
            return Err(EvaluationError::NeedsAllReadings);
        }
        let samples = recipe.samples();
        if let Some(first) = degradation.first.filter(|first| *first > samples) {
            return Err(EvaluationError::TooFewReadings { first, samples });
        }
        Ok(Self {
            degradation,
            ..self
        })
    }

    /// Returns the whole basis of the model Linear.
    fn basis(&self) -> Option<&'a Basis> {
        match &self.algorithm {
            FitAlgorithm::Scan(_, basis) => *basis,
            FitAlgorithm::RidgeAnywhere(_, basis) => Some(basis),
            FitAlgorithm::Adaptive(adaptive) => Some(adaptive.basis()),
            _ => None,
        }
    }

    /// Creates the method Random: Adam from a random start on random samples.
    #[must_use]
    pub fn random(model: ModelKind, samples: usize, steps: usize) -> Self {
        let directions = SampleDirections::Random(samples);
        Self::new(names::RANDOM, directions, FitAlgorithm::Adam(model, steps))
    }

    /// Creates the method Optimum: an estimate of the best fit of a model that is fitted by descent. It has converged
    /// after [`OPTIMUM_STEPS`](super::OPTIMUM_STEPS). Fewer steps give an approximation.
    #[must_use]
    pub fn optimum(model: ModelKind, steps: usize) -> Self {
        let directions = SampleDirections::Converged(0);
        Self::new(
            names::OPTIMUM,
            directions,
            FitAlgorithm::Optimum(model, steps),
        )
    }

    /// Creates a ridge solve of the model Linear with precision `eta` for all coefficients, such as the methods Random, NJR15
    /// (Nielsen et al. 2015) and Optimum.
    #[must_use]
    pub fn linear(
        name: &'static str,
        basis: &'a Basis,
        eta: f32,
        directions: SampleDirections,
    ) -> Self {
        let precision = vec![eta; basis.components()];
        let algorithm = FitAlgorithm::RidgeAnywhere(precision, basis);
        Self::new(name, directions, algorithm)
    }

    /// Returns the name in tables, pictures and reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match &self.algorithm {
            FitAlgorithm::Scan(recipe, _) => recipe.model(),
            FitAlgorithm::Adaptive(adaptive) => adaptive.file().recipe().model(),
            FitAlgorithm::SgdAnywhere(descent) => descent.model,
            FitAlgorithm::RidgeAnywhere(..) => ModelKind::Linear,
            FitAlgorithm::Ggx => ModelKind::CookTorrance,
            FitAlgorithm::Adam(model, _) | FitAlgorithm::Optimum(model, _) => *model,
        }
    }

    /// Returns the number of samples, n; 0 for the method Optimum.
    #[must_use]
    pub fn samples(&self) -> usize {
        match &self.directions {
            SampleDirections::Pattern(pattern) => pattern.len(),
            SampleDirections::Random(samples) | SampleDirections::Chosen(samples) => *samples,
            SampleDirections::Converged(_) => 0,
        }
    }

    /// Returns the measured directions; empty if they differ between materials.
    #[must_use]
    pub fn pattern(&self) -> &[Angles<f32>] {
        match &self.directions {
            SampleDirections::Pattern(pattern) => pattern,
            _ => &[],
        }
    }

    /// Returns true if the result depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        matches!(self.directions, SampleDirections::Random(_)) || self.degradation.is_random()
    }
}
