//! The result of a method for one material.

use glimpse_core::model::ModelKind;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{Brdf, FittedBrdf};

use super::EvaluationError;

/// The result of a method for one material.
pub struct Outcome {
    /// The fitted BRDF.
    pub fitted: Box<dyn Brdf + Send>,
    /// The parameters of the method's model; empty if the fit is not one of the four models.
    pub values: Vec<f32>,
    /// The predicted loss, if the method has one.
    pub prediction: Option<LossPrediction>,
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
            prediction: None,
            seconds: None,
        })
    }
}
