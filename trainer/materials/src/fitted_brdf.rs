//! The BRDF of a fit.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, NeuralParameters, ParameterSet};
use glimpse_kernels::ModelKernels;

use crate::basis::{Basis, Reconstruction};
use crate::{Brdf, BrdfWithDerivative};

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
        (self.model == ModelKind::Neural)
            .then(|| NeuralParameters::view(&self.values).copied())
            .flatten()
    }

    /// Returns the BRDF at angles in radians, and for each channel its derivatives with respect to theta_h, theta_d and
    /// phi_d.
    #[must_use]
    pub fn brdf_with_derivative(&self, angles: Angles<f32>) -> BrdfWithDerivative {
        if let Some(reconstruction) = &self.reconstruction {
            let brdf = reconstruction.at_angles(angles);
            let duals = reconstruction.brdf_with_derivative(&angles);
            let derivative = duals.map(|dual| dual.tangent.map(|value| value as f32));
            return (brdf, derivative);
        }
        // Linear, which has no kernels, has a reconstruction.
        let none = ([f32::NAN; 3], [[f32::NAN; 3]; 3]);
        let kernels = ModelKernels::of(self.model);
        kernels.map_or(none, |kernels| {
            (kernels.brdf_with_derivative)(&self.values, angles)
        })
    }
}

impl Brdf for FittedBrdf {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        if let Some(reconstruction) = &self.reconstruction {
            return reconstruction.values_at(at);
        }
        let mut values = vec![[f32::NAN; 3]; at.len()];
        if let Some(kernels) = ModelKernels::of(self.model) {
            (kernels.evaluate)(&self.values, at, &mut values);
        }
        values
    }
}
