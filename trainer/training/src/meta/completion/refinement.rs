//! Refinement of completed coefficients: a fit from initial parameters chosen by the StartNet.

use std::marker::PhantomData;

use glimpse_core::model::{Active, ModelKind, ParameterSet, SampleGradient};
use glimpse_kernels::LaneModel;
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewton, OctetAdjoint};
use glimpse_kernels::inner_loop::unflatten;
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights};

use super::virtual_readings::VirtualReadings;
use crate::meta::learned::LearnedSteps;

/// The inputs of a refinement of one task.
pub struct RefinementInputs<'t> {
    /// theta_0.
    pub initial: &'t [f32],
    /// The hyperparameters, all positive.
    pub hyperparameters: &'t [f32],
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
    fn initial_hyperparameters(&self) -> Vec<f32>;

    /// Returns the content of a recipe.
    fn learned(
        &self,
        initial: Vec<f32>,
        hyperparameters: Vec<f32>,
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
    pub hyperparameters: Vec<f32>,
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

/// Gauss-Newton steps toward virtual readings and those of the pattern. The hyperparameters are the precision of each
/// active parameter of a system, the sum of the weights of the pattern's readings, and the error scale.
pub struct GaussNewtonRefinement<M> {
    steps: usize,
    model: PhantomData<M>,
}

/// Virtual readings, followed by those of the pattern.
struct AllReadings {
    at: Vec<OctetDirections>,
    values: Vec<OctetRgb>,
    weights: Vec<Octet>,
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

    fn readings(inputs: &RefinementInputs<'_>, virtual_values: &[OctetRgb]) -> AllReadings {
        let readings = inputs.readings;
        let reading_weight = Self::reading_weight(inputs);
        let virtual_weight = 1.0 / inputs.virtual_readings.len() as f32;
        let mut weights = vec![Octet([virtual_weight; WIDTH]); virtual_values.len()];
        for octet in 0..readings.octets() {
            // The weight in a loss is 1 / (3 k) for k readings.
            weights.push(Octet(std::array::from_fn(|lane| {
                3.0 * reading_weight * readings.sample(octet, lane).weight
            })));
        }
        AllReadings {
            at: [&inputs.virtual_readings.octet_directions[..], readings.at].concat(),
            values: [virtual_values, readings.values].concat(),
            weights,
        }
    }

    fn reading_weight(inputs: &RefinementInputs<'_>) -> f32 {
        inputs.hyperparameters[M::ACTIVE.count()]
    }
}

impl AllReadings {
    fn octets<'s>(&'s self, readings: &SampleOctets<'_>) -> SampleOctets<'s> {
        SampleOctets {
            at: &self.at,
            values: &self.values,
            order: None,
            weights: SampleWeights::Each(&self.weights),
            instruction_set: readings.instruction_set,
            back_to_back: false,
        }
    }
}

impl<M: LaneModel> Refinement for GaussNewtonRefinement<M> {
    fn model(&self) -> ModelKind {
        M::KIND
    }

    fn initial_hyperparameters(&self) -> Vec<f32> {
        let mut list = vec![INITIAL_PRECISION; M::ACTIVE.count()];
        list.extend([1.0, INITIAL_ERROR_SCALE]);
        list
    }

    fn learned(
        &self,
        initial: Vec<f32>,
        hyperparameters: Vec<f32>,
        virtual_readings: &VirtualReadings,
    ) -> LearnedSteps {
        let (precision, others) = hyperparameters.split_at(M::ACTIVE.count());
        LearnedSteps {
            model: M::KIND,
            steps: self.steps,
            initial,
            precision: precision.to_vec(),
            reading_weight: others[0],
            error_scale: others[1],
            directions: virtual_readings.angles.clone(),
            center: virtual_readings.center.clone(),
            rows: virtual_readings.rows.clone(),
        }
    }

    fn fit(&self, inputs: &RefinementInputs<'_>) -> Vec<f32> {
        let values = inputs.virtual_readings.values(inputs.coefficients);
        let readings = Self::readings(inputs, &values.octets);
        let fit = GaussNewton::<M, f32> {
            initial: unflattened::<M>(inputs.initial),
            precision: &inputs.hyperparameters[..M::ACTIVE.count()],
            error_scale: inputs.hyperparameters[M::ACTIVE.count() + 1],
            steps: self.steps,
        };
        let (fitted, _) = M::take_steps(&fit, &readings.octets(inputs.readings));
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
        let readings = readings.octets(inputs.readings);
        let count = Active::count(M::ACTIVE);
        let fit = GaussNewton::<M, f32> {
            initial: unflattened::<M>(inputs.initial),
            precision: &inputs.hyperparameters[..count],
            error_scale: inputs.hyperparameters[count + 1],
            steps: self.steps,
        };
        let (fitted, steps) = M::take_steps(&fit, &readings);
        let mut gradient = FitGradient {
            initial: M::Parameters::filled(0.0),
            precision: vec![0.0; count],
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
        let mut hyperparameters = gradient.precision;
        hyperparameters.extend([by_weight, gradient.error_scale]);
        RefinementGradient {
            loss,
            initial: flatten::<M>(&gradient.initial),
            hyperparameters,
            coefficients,
            samples: by_readings.iter().map(|octet| octet.sample).collect(),
        }
    }
}
