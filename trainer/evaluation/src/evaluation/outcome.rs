//! The result of a method for one material.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::model::ModelKind;
use glimpse_fitting::linear::{Posterior, PosteriorReading};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{Brdf, FittedBrdf, Material};

use super::EvaluationError;

/// The result of a method for one material.
pub struct Outcome {
    /// The fitted BRDF.
    pub fitted: Box<dyn Brdf + Send>,
    /// The parameters of the method's model; empty if the fit is not one of the four models.
    pub values: Vec<f32>,
    /// The predictions of the fit.
    pub forecast: Forecast,
}

/// The predictions of a fit, and the time of its scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct Forecast {
    /// The predicted loss, if the method has one.
    pub prediction: Option<LossPrediction>,
    /// The share of directions at which the material is within one predicted standard deviation of the fit; None without a
    /// posterior.
    pub coverage: Option<f64>,
    /// The time of a scan that chooses directions by seconds, in seconds.
    pub seconds: Option<f64>,
}

impl Outcome {
    /// Creates the result of a fit without a prediction.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`] if the values do not match the model or its basis.
    pub(super) fn new(
        model: ModelKind,
        values: Vec<f32>,
        basis: Option<&BasisTable>,
    ) -> Result<Self, EvaluationError> {
        let fitted = FittedBrdf::new(model, values.clone(), basis).ok_or(EvaluationError::Basis)?;
        Ok(Self {
            fitted: Box::new(fitted),
            values,
            forecast: Forecast::default(),
        })
    }

    /// Creates the result of a host's fit of readings of a material by sample, with the directions of a recipe's samples. The
    /// posterior predicts the loss if the recipe does not.
    ///
    /// # Errors
    /// [`EvaluationError::Scan`], [`EvaluationError::Basis`]
    pub(super) fn of_readings(
        recipe: &NamedRecipe,
        samples: &[Option<PosteriorReading>],
        material: &dyn Material,
    ) -> Result<Self, EvaluationError> {
        let present: Vec<PosteriorReading> = samples.iter().flatten().cloned().collect();
        let posterior = Posterior::new(&recipe.prior, &present);
        let posterior = &posterior.ok_or(Error::new(ErrorCode::Diverged))?;
        let mut exact = posterior.exact(&present).into_iter();
        let exact = samples
            .iter()
            .map(|sample| sample.as_ref().and_then(|_| exact.next()));
        let exact: Vec<Option<[f32; 3]>> = exact.collect();
        let mut read = |index, _| *exact.get(usize::from(index))?;
        let scan = recipe.scan(posterior, &mut read)?;
        let basis = recipe.basis_of(posterior);
        let outcome = Self::new(recipe.file.recipe().model(), scan.values, basis.as_deref())?;
        let prediction = scan.prediction;
        Ok(Self {
            forecast: Forecast {
                coverage: Some(posterior.coverage(&*outcome.fitted, material)),
                prediction: Some(prediction.unwrap_or_else(|| posterior.loss(&*outcome.fitted))),
                seconds: None,
            },
            ..outcome
        })
    }
}
