//! The BRDF of a fit.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::brdf::with_derivative;
use glimpse_kernels::inner_loop::unflatten;
use glimpse_kernels::{LaneModel, with_model};

use crate::Brdf;
use crate::basis::{Basis, Reconstruction};

/// The BRDF of a fit: a model and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedBrdf {
    model: ModelKind,
    values: Vec<f32>,
    /// The tabulated BRDF of the model Linear, or None for other models.
    reconstruction: Option<Reconstruction>,
}

impl FittedBrdf {
    /// Makes a BRDF from a model's parameters, or from the coefficients of Linear (m for red, m for green, m for blue)
    /// and a basis. Returns None if the number of values is wrong, or if the model is Linear and `basis` is None.
    #[must_use]
    pub fn new(model: ModelKind, values: Vec<f32>, basis: Option<&Basis>) -> Option<Self> {
        let reconstruction = match model.parameters() {
            Some(count) if count == values.len() => None,
            Some(_) => return None,
            None => Some(basis?.reconstruct_values(&values).ok()?),
        };
        Some(Self {
            model,
            values,
            reconstruction,
        })
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// Returns the model's parameters, or Linear's coefficients.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the weights of the model Neural, or None for other models.
    #[must_use]
    pub fn network(&self) -> Option<NeuralParameters<f32>> {
        (self.model == ModelKind::Neural).then(|| self.parameters::<Neural>())
    }

    fn parameters<M: Model>(&self) -> M::Parameters<f32> {
        let mut parameters = M::Parameters::filled(0.0);
        unflatten(&self.values, &mut parameters);
        parameters
    }

    /// Returns the BRDF at angles in radians, and for each channel its derivatives with respect to theta_h, theta_d and
    /// phi_d.
    #[must_use]
    pub fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        if let Some(reconstruction) = &self.reconstruction {
            let brdf = reconstruction.at_angles(angles);
            let duals = reconstruction.brdf_with_derivative(&angles);
            let derivative = duals.map(|dual| dual.tangent.map(|value| value as f32));
            return (brdf, derivative);
        }
        // The last arm is never used: the model Linear has a reconstruction.
        with_model!(self.model, M => {
            with_derivative::<M>(&self.parameters::<M>(), angles)
        }, _ => ([f32::NAN; 3], [[f32::NAN; 3]; 3]))
    }
}

impl Brdf for FittedBrdf {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        if let Some(reconstruction) = &self.reconstruction {
            return reconstruction.evaluate(at, brdf);
        }
        // The last arm is never used: the model Linear has a reconstruction.
        with_model!(self.model, M => {
            <M as LaneModel>::evaluate(&self.parameters::<M>(), at, brdf);
        }, _ => brdf.fill([f32::NAN; 3]));
    }
}
