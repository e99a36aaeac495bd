//! Refinement of completed coefficients: a fit from initial parameters chosen by the StartNet.

use std::marker::PhantomData;

use glimpse_core::model::{ModelKind, ParameterSet, SampleGradient};
use glimpse_kernels::LaneModel;
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewton, OctetAdjoint};
use glimpse_kernels::inner_loop::unflatten;
use glimpse_kernels::lanes::{Octet, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets};

use super::hyperparameters::StepParameters;
use super::virtual_readings::VirtualReadings;
use crate::meta::learned::LearnedSteps;
use crate::meta::samples::WeightedSamples;

/// The inputs of a refinement of one task.
pub struct RefinementInputs<'t> {
    /// theta_0.
    pub initial: &'t [f32],
    /// The hyperparameters, all positive.
    pub hyperparameters: &'t StepParameters,
    /// The completed coefficients of red, then green, then blue.
    pub coefficients: &'t [f32],
    /// The readings that are present.
    pub readings: &'t SampleOctets<'t>,
    /// The directions of virtual readings.
    pub virtual_readings: &'t VirtualReadings,
}

/// A fit that starts from the initial parameters of a task.
pub trait Refinement: Sync {
    /// Returns the model.
    fn model(&self) -> ModelKind;

    /// Returns the hyperparameters before training, all positive.
    fn initial_hyperparameters(&self) -> StepParameters;

    /// Returns the content of a recipe.
    fn learned(
        &self,
        initial: Vec<f32>,
        hyperparameters: StepParameters,
        virtual_readings: &VirtualReadings,
    ) -> LearnedSteps;

    /// Returns the fitted parameters.
    fn fit(&self, inputs: &RefinementInputs<'_>) -> Vec<f32>;

    /// Returns the loss of parameters on the `outer` samples.
    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32;

    /// Returns the loss after the fit, and its gradient.
    fn gradient(
        &self,
        inputs: &RefinementInputs<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient;
}

/// The loss after a fit, and its gradient.
pub struct RefinementGradient {
    /// The loss.
    pub loss: f32,
    /// The gradient with respect to the initial parameters.
    pub initial: Vec<f32>,
    /// The gradient with respect to the hyperparameters.
    pub hyperparameters: StepParameters,
    /// The gradient with respect to the coefficients, by way of virtual readings.
    pub coefficients: Vec<f32>,
    /// The gradient with respect to each octet of readings.
    pub samples: Vec<SampleGradient<Octet>>,
}

fn flatten<M: LaneModel>(parameters: &M::Parameters<f32>) -> Vec<f32> {
    parameters.iter().copied().collect()
}

fn unflattened<M: LaneModel>(list: &[f32]) -> M::Parameters<f32> {
    let mut parameters = M::Parameters::filled(0.0);
    unflatten(list, &mut parameters);
    parameters
}

/// The precision of each parameter before training.
const INITIAL_PRECISION: f32 = 0.02;
/// The error scale before training.
const INITIAL_ERROR_SCALE: f32 = 0.1;

/// Gauss-Newton steps toward virtual readings and those of the pattern.
pub struct GaussNewtonRefinement<M> {
    steps: usize,
    model: PhantomData<M>,
}

impl<M: LaneModel> GaussNewtonRefinement<M> {
    /// Creates a fit of `steps` steps.
    #[must_use]
    pub fn new(steps: usize) -> Self {
        Self {
            steps,
            model: PhantomData,
        }
    }

    /// Returns virtual readings, followed by those of the pattern.
    fn readings(
        inputs: &RefinementInputs<'_>,
        virtual_values: &[OctetRgb],
    ) -> WeightedSamples<'static> {
        let readings = inputs.readings;
        let virtual_weight = 1.0 / inputs.virtual_readings.len() as f32;
        let mut weights = vec![Octet([virtual_weight; WIDTH]); virtual_values.len()];
        for octet in 0..readings.octets() {
            // The weight in a loss is 1 / (3 k) for k readings.
            weights.push(Octet(std::array::from_fn(|lane| {
                3.0 * inputs.hyperparameters.reading_weight * readings.sample(octet, lane).weight
            })));
        }
        let directions = [&inputs.virtual_readings.octet_directions[..], readings.at].concat();
        let values = [virtual_values, readings.values].concat();
        WeightedSamples::new(directions.into(), values, weights)
    }

    fn fit<'t>(&self, inputs: &'t RefinementInputs<'_>) -> GaussNewton<'t, M, f32> {
        GaussNewton {
            initial: unflattened::<M>(inputs.initial),
            precision: &inputs.hyperparameters.precision,
            error_scale: inputs.hyperparameters.error_scale,
            steps: self.steps,
        }
    }
}

impl<M: LaneModel> Refinement for GaussNewtonRefinement<M> {
    fn model(&self) -> ModelKind {
        M::KIND
    }

    fn initial_hyperparameters(&self) -> StepParameters {
        StepParameters {
            precision: vec![INITIAL_PRECISION; M::ACTIVE.count()],
            reading_weight: 1.0,
            error_scale: INITIAL_ERROR_SCALE,
        }
    }

    fn learned(
        &self,
        initial: Vec<f32>,
        hyperparameters: StepParameters,
        virtual_readings: &VirtualReadings,
    ) -> LearnedSteps {
        LearnedSteps {
            model: M::KIND,
            steps: self.steps,
            initial,
            precision: hyperparameters.precision,
            reading_weight: hyperparameters.reading_weight,
            error_scale: hyperparameters.error_scale,
            directions: virtual_readings.at.angles.clone(),
            center: virtual_readings.at.means(),
            rows: virtual_readings.at.rows.clone(),
        }
    }

    fn fit(&self, inputs: &RefinementInputs<'_>) -> Vec<f32> {
        let values = inputs.virtual_readings.values(inputs.coefficients);
        let readings = Self::readings(inputs, &values.octets);
        let (fitted, _) = M::take_steps(&self.fit(inputs), &readings.octets());
        flatten::<M>(&fitted)
    }

    fn loss(&self, parameters: &[f32], outer: &SampleOctets<'_>) -> f32 {
        M::loss(&unflattened::<M>(parameters), outer)
    }

    fn gradient(
        &self,
        inputs: &RefinementInputs<'_>,
        outer: &SampleOctets<'_>,
    ) -> RefinementGradient {
        let values = inputs.virtual_readings.values(inputs.coefficients);
        let readings = Self::readings(inputs, &values.octets);
        let readings = readings.octets();
        let fit = self.fit(inputs);
        let (fitted, steps) = M::take_steps(&fit, &readings);
        let mut gradient = FitGradient {
            initial: M::Parameters::filled(0.0),
            precision: vec![0.0; M::ACTIVE.count()],
            error_scale: 0.0,
        };
        let loss = M::gradient(&fitted, outer, &mut gradient.initial);
        let mut derivatives = OctetAdjoint::zeros(&readings);
        M::steps_adjoint(&fit, &steps, &readings, &mut gradient, &mut derivatives);
        let (by_virtual, by_readings) =
            derivatives.split_at(inputs.virtual_readings.octet_directions.len());
        let mut coefficients = vec![0.0; inputs.coefficients.len()];
        let by_brdf = by_virtual.iter().flat_map(|octet| {
            let measured = octet.sample.measured;
            (0..WIDTH).map(move |lane| measured.map(|by_channel| by_channel.0[lane]))
        });
        inputs
            .virtual_readings
            .add_gradient(&values, by_brdf, &mut coefficients);
        // The weight of a present reading is proportional to the hyperparameter.
        let mut by_weight = 0.0;
        for (octet, by_octet) in by_readings.iter().enumerate() {
            for lane in 0..WIDTH {
                let weight = 3.0 * inputs.readings.sample(octet, lane).weight;
                by_weight += weight * by_octet.weight.0[lane];
            }
        }
        RefinementGradient {
            loss,
            initial: flatten::<M>(&gradient.initial),
            hyperparameters: StepParameters {
                precision: gradient.precision,
                reading_weight: by_weight,
                error_scale: gradient.error_scale,
            },
            coefficients,
            samples: by_readings.iter().map(|octet| octet.sample).collect(),
        }
    }
}
