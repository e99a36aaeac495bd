//! The neural model of Sztrajman et al. (2021): 6-21-21-3, ReLU, 675 parameters.
//!
//! f = max(exp(z) - 1, 0), z the output of a multi-layer perceptron whose input is the unit half
//! and difference vector (hx, hy, hz, dx, dy, dz). (Paper, "Models: Neural networks".)

use super::{Evaluation, Model, ModelKind, ParameterSet, Sample, SampleGradient};
use crate::angles::HalfDifference;
use crate::loss::cosine_weighted_log_error;
use crate::scalar::{Entry, Scalar};

/// Units of each hidden layer.
const HIDDEN: usize = 21;
/// Outputs of a layer that are computed together, so that they stay in registers.
const TILE: usize = 3;

/// The model; see the file's head for its formula.
#[derive(Clone, Copy, Debug)]
pub struct Neural;

/// One value for each of the network's parameters; matrices are inputs-by-outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeuralParameters<T> {
    /// First layer. Row 1 belongs to hy, which is always 0, so it neither matters nor learns.
    pub fc1: [[T; HIDDEN]; 6],
    /// Bias of the first layer.
    pub b1: [T; HIDDEN],
    /// Second layer.
    pub fc2: [[T; HIDDEN]; HIDDEN],
    /// Bias of the second layer.
    pub b2: [T; HIDDEN],
    /// Output layer.
    pub fc3: [[T; 3]; HIDDEN],
    /// Bias of the output layer.
    pub b3: [T; 3],
}

impl<T: Entry> ParameterSet<T> for NeuralParameters<T> {
    fn filled(value: T) -> Self {
        Self {
            fc1: [[value; HIDDEN]; 6],
            b1: [value; HIDDEN],
            fc2: [[value; HIDDEN]; HIDDEN],
            b2: [value; HIDDEN],
            fc3: [[value; 3]; HIDDEN],
            b3: [value; 3],
        }
    }

    #[inline(always)]
    fn runs(&self) -> impl Iterator<Item = &[T]> {
        [
            self.fc1.as_flattened(),
            &self.b1,
            self.fc2.as_flattened(),
            &self.b2,
            self.fc3.as_flattened(),
            &self.b3,
        ]
        .into_iter()
    }

    #[inline(always)]
    fn runs_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        [
            self.fc1.as_flattened_mut(),
            &mut self.b1,
            self.fc2.as_flattened_mut(),
            &mut self.b2,
            self.fc3.as_flattened_mut(),
            &mut self.b3,
        ]
        .into_iter()
    }
}

/// bias + inputs * weights.
///
/// `inputs` yields each input with its row of weights; it borrows them, because it is cloned for
/// each tile.
#[inline(always)]
fn affine<'a, S: Scalar, const OUTPUTS: usize>(
    inputs: impl Iterator<Item = (&'a S, &'a [S::Parameter; OUTPUTS])> + Clone,
    bias: &[S::Parameter; OUTPUTS],
) -> [S; OUTPUTS] {
    let mut outputs = [S::constant(0.0); OUTPUTS];
    for (output, bias) in outputs.iter_mut().zip(bias) {
        *output = S::broadcast(*bias);
    }
    for (tile, block) in outputs.as_chunks_mut::<TILE>().0.iter_mut().enumerate() {
        let mut sums = *block;
        for (input, row) in inputs.clone() {
            if let Some(weights) = row.as_chunks::<TILE>().0.get(tile) {
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum = sum.plus_product(*input, S::broadcast(*weight));
                }
            }
        }
        *block = sums;
    }
    outputs
}

/// The gradient by a layer's inputs: weights times the gradient by its outputs.
#[inline(always)]
fn backward<S: Scalar, const INPUTS: usize, const OUTPUTS: usize>(
    weights: &[[S::Parameter; OUTPUTS]; INPUTS],
    by_outputs: &[S; OUTPUTS],
) -> [S; INPUTS] {
    let mut by_inputs = [S::constant(0.0); INPUTS];
    let blocks = by_inputs.as_chunks_mut::<TILE>().0.iter_mut();
    for (block, rows) in blocks.zip(weights.as_chunks::<TILE>().0) {
        let [row_0, row_1, row_2] = rows;
        let mut sums = *block;
        for (((by_output, a), b), c) in by_outputs.iter().zip(row_0).zip(row_1).zip(row_2) {
            let [sum_0, sum_1, sum_2] = &mut sums;
            *sum_0 = sum_0.plus_product(*by_output, S::broadcast(*a));
            *sum_1 = sum_1.plus_product(*by_output, S::broadcast(*b));
            *sum_2 = sum_2.plus_product(*by_output, S::broadcast(*c));
        }
        *block = sums;
    }
    by_inputs
}

/// Adds the gradient by a layer's weights and bias.
#[inline(always)]
fn accumulate<'a, S: Scalar, const OUTPUTS: usize>(
    inputs: impl Iterator<Item = (&'a S, &'a mut [S::Sum; OUTPUTS])>,
    bias: &mut [S::Sum; OUTPUTS],
    by_outputs: &[S; OUTPUTS],
) {
    for (input, row) in inputs {
        S::add_products(row, *input, by_outputs);
    }
    S::add_all(bias, by_outputs);
}

#[inline(always)]
fn relu<S: Scalar>(mut values: [S; HIDDEN]) -> [S; HIDDEN] {
    for value in &mut values {
        *value = value.relu();
    }
    values
}

/// Activations of both hidden layers, and the output before its activation.
struct Forward<S> {
    hidden_1: [S; HIDDEN],
    hidden_2: [S; HIDDEN],
    output: [S; 3],
}

impl<S: Scalar> Forward<S> {
    #[inline(always)]
    fn new(parameters: &NeuralParameters<S::Parameter>, at: &HalfDifference<S>) -> Self {
        let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &parameters.fc1;
        let inputs = [
            (&at.hx, row_hx),
            (&at.hz, row_hz),
            (&at.dx, row_dx),
            (&at.dy, row_dy),
            (&at.dz, row_dz),
        ];
        let hidden_1 = relu(affine(inputs.iter().copied(), &parameters.b1));
        let rows = hidden_1.iter().zip(&parameters.fc2);
        let hidden_2 = relu(affine(rows, &parameters.b2));
        let rows = hidden_2.iter().zip(&parameters.fc3);
        let output = affine(rows, &parameters.b3);
        Self {
            hidden_1,
            hidden_2,
            output,
        }
    }
}

/// The gradient before a ReLU, given the one after it; the unit was on where its value is > 0.
#[inline(always)]
fn through_relu<S: Scalar>(mut by_values: [S; HIDDEN], values: &[S; HIDDEN]) -> [S; HIDDEN] {
    for (by_value, value) in by_values.iter_mut().zip(values) {
        *by_value = value.if_positive(*by_value, S::constant(0.0));
    }
    by_values
}

impl Model for Neural {
    const KIND: ModelKind = ModelKind::Neural;
    const PARAMETERS: usize = 6 * HIDDEN + HIDDEN + HIDDEN * HIDDEN + HIDDEN + HIDDEN * 3 + 3;
    type Parameters<T: Entry> = NeuralParameters<T>;
    const ZEROS: NeuralParameters<f32> = NeuralParameters {
        fc1: [[0.0; HIDDEN]; 6],
        b1: [0.0; HIDDEN],
        fc2: [[0.0; HIDDEN]; HIDDEN],
        b2: [0.0; HIDDEN],
        fc3: [[0.0; 3]; HIDDEN],
        b3: [0.0; 3],
    };

    #[inline(always)]
    fn brdf<S: Scalar>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        let forward = Forward::new(parameters, at);
        let mut brdf = forward.output;
        for f in &mut brdf {
            *f = (f.exp() - S::constant(1.0)).relu();
        }
        brdf
    }

    #[inline(always)]
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &NeuralParameters<S::Parameter>,
        sample: &Sample<S>,
        gradient: &mut NeuralParameters<S::Sum>,
    ) -> Evaluation<S> {
        let zero = S::constant(0.0);
        let at = &sample.at;
        let forward = Forward::new(parameters, at);
        let mut exponentials = forward.output;
        let mut modelled = forward.output;
        for (exponential, f) in exponentials.iter_mut().zip(&mut modelled) {
            *exponential = exponential.exp();
            *f = (*exponential - S::constant(1.0)).relu();
        }
        let loss =
            cosine_weighted_log_error(sample.measured, modelled, at.cos_theta_i(), sample.weight);

        let mut by_output = loss.by_modelled;
        for ((by_z, z), exponential) in by_output.iter_mut().zip(forward.output).zip(exponentials) {
            *by_z = z.if_positive(*by_z * exponential, zero);
        }
        let by_hidden_2 = through_relu(backward(&parameters.fc3, &by_output), &forward.hidden_2);
        let by_hidden_1 = through_relu(backward(&parameters.fc2, &by_hidden_2), &forward.hidden_1);

        let rows = forward.hidden_2.iter().zip(&mut gradient.fc3);
        accumulate(rows, &mut gradient.b3, &by_output);
        let rows = forward.hidden_1.iter().zip(&mut gradient.fc2);
        accumulate(rows, &mut gradient.b2, &by_hidden_2);
        let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &mut gradient.fc1;
        let inputs = [
            (&at.hx, row_hx),
            (&at.hz, row_hz),
            (&at.dx, row_dx),
            (&at.dy, row_dy),
            (&at.dz, row_dz),
        ];
        accumulate(inputs.into_iter(), &mut gradient.b1, &by_hidden_1);

        let mut by_sample = SampleGradient::zero();
        if SAMPLE {
            let [hx, _, hz, dx, dy, dz] = backward(&parameters.fc1, &by_hidden_1);
            let c = loss.by_cosine;
            by_sample.at = HalfDifference {
                hx: hx - c * at.dx,
                hz: hz + c * at.dz,
                dx: dx - c * at.hx,
                dy,
                dz: dz + c * at.hz,
            };
            by_sample.measured = loss.by_measured;
        }
        Evaluation {
            loss: loss.value,
            gradient: by_sample,
        }
    }
}
