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

/// A layer: bias plus inputs * weights; with `RELU` followed by one. (Constants and not functions as
/// arguments: those stay out of line where lanes are compiled.)
///
/// `inputs` yields each input with its row of weights; it borrows them, because it is cloned for
/// each tile.
#[inline(always)]
fn affine<'a, S: Scalar, const OUTPUTS: usize, const RELU: bool>(
    inputs: impl Iterator<Item = (&'a S, &'a [S::Parameter; OUTPUTS])> + Clone,
    bias: &[S::Parameter; OUTPUTS],
    outputs: &mut [S; OUTPUTS],
) {
    let tiles = outputs.as_chunks_mut::<TILE>().0.iter_mut();
    for (tile, (block, bias)) in tiles.zip(bias.as_chunks::<TILE>().0).enumerate() {
        let mut sums = [S::constant(0.0); TILE];
        for (sum, bias) in sums.iter_mut().zip(bias) {
            *sum = S::broadcast(*bias);
        }
        for (input, row) in inputs.clone() {
            if let Some(weights) = row.as_chunks::<TILE>().0.get(tile) {
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum = sum.plus_product(*input, S::broadcast(*weight));
                }
            }
        }
        for (output, sum) in block.iter_mut().zip(sums) {
            *output = if RELU { sum.relu() } else { sum };
        }
    }
}

/// The gradient by a layer's inputs: weights times the gradient by its outputs. With
/// `RELU` what is in its place so far is the input's value, and it was on where that is > 0.
#[inline(always)]
fn backward<S: Scalar, const INPUTS: usize, const OUTPUTS: usize, const RELU: bool>(
    weights: &[[S::Parameter; OUTPUTS]; INPUTS],
    by_outputs: &[S; OUTPUTS],
    by_inputs: &mut [S; INPUTS],
) {
    let blocks = by_inputs.as_chunks_mut::<TILE>().0.iter_mut();
    for (block, rows) in blocks.zip(weights.as_chunks::<TILE>().0) {
        let mut sums = [S::constant(0.0); TILE];
        for (column, by_output) in by_outputs.iter().enumerate() {
            for (sum, row) in sums.iter_mut().zip(rows) {
                if let Some(weight) = row.get(column) {
                    *sum = sum.plus_product(*by_output, S::broadcast(*weight));
                }
            }
        }
        for (by_input, sum) in block.iter_mut().zip(sums) {
            *by_input = if RELU {
                by_input.if_positive(sum, S::constant(0.0))
            } else {
                sum
            };
        }
    }
}

/// Adds the gradient by a layer's weights, which has a row for each input.
#[inline(always)]
fn accumulate<S: Scalar, const INPUTS: usize, const OUTPUTS: usize>(
    gradient: &mut [[S::Sum; OUTPUTS]; INPUTS],
    inputs: &[S; INPUTS],
    by_outputs: &[S; OUTPUTS],
) {
    let tiles = gradient.as_chunks_mut::<TILE>().0.iter_mut();
    for (rows, inputs) in tiles.zip(inputs.as_chunks::<TILE>().0) {
        S::add_outer_product(rows.each_mut(), *inputs, by_outputs);
    }
}

/// Runs the network: the activations of both hidden layers, and the output before its activation.
/// In place: what is returned by value may be copied.
#[inline(always)]
fn forward<S: Scalar>(
    parameters: &NeuralParameters<S::Parameter>,
    at: &HalfDifference<S>,
    hidden_1: &mut [S; HIDDEN],
    hidden_2: &mut [S; HIDDEN],
    output: &mut [S; 3],
) {
    let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &parameters.fc1;
    let inputs = [
        (&at.hx, row_hx),
        (&at.hz, row_hz),
        (&at.dx, row_dx),
        (&at.dy, row_dy),
        (&at.dz, row_dz),
    ];
    affine::<_, _, true>(inputs.iter().copied(), &parameters.b1, hidden_1);
    affine::<_, _, true>(
        hidden_1.iter().zip(&parameters.fc2),
        &parameters.b2,
        hidden_2,
    );
    affine::<_, _, false>(hidden_2.iter().zip(&parameters.fc3), &parameters.b3, output);
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
        let mut hidden_1 = [S::constant(0.0); HIDDEN];
        let mut hidden_2 = [S::constant(0.0); HIDDEN];
        let mut brdf = [S::constant(0.0); 3];
        forward(parameters, at, &mut hidden_1, &mut hidden_2, &mut brdf);
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
        let (zero, one) = (S::constant(0.0), S::constant(1.0));
        let at = &sample.at;
        let mut hidden_1 = [zero; HIDDEN];
        let mut hidden_2 = [zero; HIDDEN];
        let mut modelled = [zero; 3];
        forward(parameters, at, &mut hidden_1, &mut hidden_2, &mut modelled);
        for f in &mut modelled {
            *f = (f.exp() - one).relu();
        }
        let loss =
            cosine_weighted_log_error(sample.measured, modelled, at.cos_theta_i(), sample.weight);

        // d f / d z = exp(z) = f + 1, where f is not cut off.
        let mut by_output = loss.by_modelled;
        for (by_z, f) in by_output.iter_mut().zip(modelled) {
            *by_z = f.if_positive(*by_z * (f + one), zero);
        }
        // Once a layer's activations have served, the gradient by them takes their place: a
        // microcontroller's stack holds each of them once.
        accumulate(&mut gradient.fc3, &hidden_2, &by_output);
        S::add_all(&mut gradient.b3, &by_output);
        backward::<_, _, _, true>(&parameters.fc3, &by_output, &mut hidden_2);
        let by_hidden_2 = &hidden_2;
        accumulate(&mut gradient.fc2, &hidden_1, by_hidden_2);
        S::add_all(&mut gradient.b2, by_hidden_2);
        backward::<_, _, _, true>(&parameters.fc2, by_hidden_2, &mut hidden_1);
        let by_hidden_1 = &hidden_1;
        let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &mut gradient.fc1;
        S::add_outer_product(
            [row_hx, row_hz, row_dx, row_dy, row_dz],
            [at.hx, at.hz, at.dx, at.dy, at.dz],
            by_hidden_1,
        );
        S::add_all(&mut gradient.b1, by_hidden_1);

        let mut by_sample = SampleGradient::zero();
        if SAMPLE {
            let mut by_input = [zero; 6];
            backward::<_, _, _, false>(&parameters.fc1, by_hidden_1, &mut by_input);
            let [hx, _, hz, dx, dy, dz] = by_input;
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
            error: loss.error,
            gradient: by_sample,
        }
    }
}
