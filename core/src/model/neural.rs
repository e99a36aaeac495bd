//! The neural model of Sztrajman et al. (2021): 6-21-21-3, ReLU, 675 parameters.
//!
//! f = max(exp(z) - 1, 0), z the output of a multi-layer perceptron whose input is the unit half
//! and difference vector (hx, hy, hz, dx, dy, dz). (Paper, "Models: Neural networks".)
//!
//! It is isotropic by its input, but neither reciprocal nor the same for all phi_d at theta_h = 0 by
//! construction: light and sensor exchanged are phi_d + pi, the difference vector (-dx, -dy, dz),
//! which the network has not seen to be the same, so that f(i, o) and f(o, i) are alike only as far
//! as the training materials taught it. Whoever needs reciprocity takes the mean of both. At the pole
//! [`HalfDifference::from_directions`] decides for phi_d = 0, for both orders of the directions.

use super::{Evaluation, Model, ModelKind, ParameterSet, Sample, SampleGradient};
use crate::geometry::HalfDifference;
use crate::model::loss::cosine_weighted_log_error;
use crate::numeric::{Scalar, Value};

/// Units of each hidden layer.
const HIDDEN: usize = 21;
/// Units that are computed together, so that they stay in registers, where a scalar fills one.
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

impl<T: Value> ParameterSet<T> for NeuralParameters<T> {
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
/// each tile of `TILE` outputs.
#[inline(always)]
fn affine<'a, S: Scalar, const OUTPUTS: usize, const TILE: usize, const RELU: bool>(
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
            if input.is_zero() {
                continue;
            }
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

/// Some rows of weights times the gradient by a layer's outputs: the gradient by its inputs.
#[inline(always)]
fn by_inputs<S: Scalar, const ROWS: usize, const OUTPUTS: usize>(
    rows: [&[S::Parameter; OUTPUTS]; ROWS],
    by_outputs: &[S; OUTPUTS],
) -> [S; ROWS] {
    let mut sums = [S::constant(0.0); ROWS];
    for (column, by_output) in by_outputs.iter().enumerate() {
        for (sum, row) in sums.iter_mut().zip(rows) {
            if let Some(weight) = row.get(column) {
                *sum = sum.plus_product(*by_output, S::broadcast(*weight));
            }
        }
    }
    sums
}

/// From the gradient by a layer's outputs: adds that by its weights to `by_weights`, puts that by the
/// units which are its inputs in place of their activations, and adds it to `by_biases` of theirs.
///
/// A unit that was off neither learns nor passes anything on: its row is left out, or its gradient 0.
#[inline(always)]
fn backward<S: Scalar, const UNITS: usize, const OUTPUTS: usize, const ROWS: usize>(
    weights: &[[S::Parameter; OUTPUTS]; UNITS],
    by_outputs: &[S; OUTPUTS],
    units: &mut [S; UNITS],
    by_weights: &mut [[S::Sum; OUTPUTS]; UNITS],
    by_biases: &mut [S::Sum; UNITS],
) {
    let skips = S::SKIPS_ZEROS && ROWS == 1;
    let by_outputs = *by_outputs;
    let blocks = units.as_chunks_mut::<ROWS>().0.iter_mut();
    let rows = weights.as_chunks::<ROWS>().0.iter();
    let by_rows = by_weights.as_chunks_mut::<ROWS>().0.iter_mut();
    let biases = by_biases.as_chunks_mut::<ROWS>().0.iter_mut();
    for (((block, rows), by_rows), by_biases) in blocks.zip(rows).zip(by_rows).zip(biases) {
        if skips && block.iter().all(S::is_zero) {
            continue;
        }
        S::add_outer_product(by_rows.each_mut(), *block, &by_outputs);
        let by_units = by_inputs(rows.each_ref(), &by_outputs);
        if skips {
            *block = by_units; // the one unit of the block was on
            S::add_all(by_biases, block);
        } else {
            for (unit, by_unit) in block.iter_mut().zip(by_units) {
                *unit = unit.if_positive(by_unit, S::constant(0.0));
            }
        }
    }
    if !skips {
        S::add_all(by_biases, units);
    }
}

/// The units of both hidden layers: their activations, and once those have served, the gradient by
/// them. A microcontroller's stack holds them once.
struct Hidden<S> {
    first: [S; HIDDEN],
    second: [S; HIDDEN],
}

impl<S: Scalar> Hidden<S> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            first: [S::constant(0.0); HIDDEN],
            second: [S::constant(0.0); HIDDEN],
        }
    }
}

/// Runs the network: the activations of both hidden layers, and the output before its activation.
#[inline(always)]
fn forward<S: Scalar, const TILE: usize>(
    parameters: &NeuralParameters<S::Parameter>,
    at: &HalfDifference<S>,
    hidden: &mut Hidden<S>,
) -> [S; 3] {
    let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &parameters.fc1;
    let inputs = [
        (&at.hx, row_hx),
        (&at.hz, row_hz),
        (&at.dx, row_dx),
        (&at.dy, row_dy),
        (&at.dz, row_dz),
    ];
    let Hidden { first, second } = hidden;
    affine::<_, _, TILE, true>(inputs.iter().copied(), &parameters.b1, first);
    affine::<_, _, TILE, true>(first.iter().zip(&parameters.fc2), &parameters.b2, second);
    let mut output = [S::constant(0.0); 3];
    affine::<_, _, 3, false>(
        second.iter().zip(&parameters.fc3),
        &parameters.b3,
        &mut output,
    );
    output
}

/// The weighted loss at a sample; adds its gradient by the parameters to `gradient`. With `SAMPLE`,
/// the gradient by the sample comes back too.
#[inline(always)]
fn gradient<S: Scalar, const TILE: usize, const ROWS: usize, const SAMPLE: bool>(
    parameters: &NeuralParameters<S::Parameter>,
    sample: &Sample<S>,
    hidden: &mut Hidden<S>,
    gradient: &mut NeuralParameters<S::Sum>,
) -> Evaluation<S> {
    let (zero, one) = (S::constant(0.0), S::constant(1.0));
    let at = &sample.at;
    let mut modelled = forward::<S, TILE>(parameters, at, hidden);
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
    S::add_all(&mut gradient.b3, &by_output);
    let Hidden { first, second } = hidden;
    backward::<S, HIDDEN, 3, ROWS>(
        &parameters.fc3,
        &by_output,
        second,
        &mut gradient.fc3,
        &mut gradient.b2,
    );
    backward::<S, HIDDEN, HIDDEN, ROWS>(
        &parameters.fc2,
        second,
        first,
        &mut gradient.fc2,
        &mut gradient.b1,
    );
    let by_first = first;
    let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &mut gradient.fc1;
    S::add_outer_product(
        [row_hx, row_hz, row_dx, row_dy, row_dz],
        [at.hx, at.hz, at.dx, at.dy, at.dz],
        by_first,
    );

    let mut by_sample = SampleGradient::zero();
    if SAMPLE {
        let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = &parameters.fc1;
        let [hx, hz, dx, dy, dz] = by_inputs([row_hx, row_hz, row_dx, row_dy, row_dz], by_first);
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

impl Model for Neural {
    const KIND: ModelKind = ModelKind::Neural;
    const PARAMETERS: usize = 6 * HIDDEN + HIDDEN + HIDDEN * HIDDEN + HIDDEN + HIDDEN * 3 + 3;
    type Parameters<T: Value> = NeuralParameters<T>;
    const ZEROS: NeuralParameters<f32> = NeuralParameters {
        fc1: [[0.0; HIDDEN]; 6],
        b1: [0.0; HIDDEN],
        fc2: [[0.0; HIDDEN]; HIDDEN],
        b2: [0.0; HIDDEN],
        fc3: [[0.0; 3]; HIDDEN],
        b3: [0.0; 3],
    };
    type Scratch = [f32; 0];
    const NO_SCRATCH: [f32; 0] = [];

    #[inline(always)]
    fn brdf<S: Scalar>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        let mut hidden = Hidden::zero();
        // In small tiles on the device too: it takes a third of the flash, and is not what takes time.
        let mut brdf = forward::<S, TILE>(parameters, at, &mut hidden);
        for f in &mut brdf {
            *f = (f.exp() - S::constant(1.0)).relu();
        }
        brdf
    }

    #[inline(always)]
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &NeuralParameters<S::Parameter>,
        sample: &Sample<S>,
        by_parameters: &mut NeuralParameters<S::Sum>,
    ) -> Evaluation<S> {
        let mut hidden = Hidden::zero();
        if S::SKIPS_ZEROS {
            gradient::<S, HIDDEN, 1, SAMPLE>(parameters, sample, &mut hidden, by_parameters)
        } else {
            gradient::<S, TILE, TILE, SAMPLE>(parameters, sample, &mut hidden, by_parameters)
        }
    }

    /// One by one: half of the units are off in a sample, but few in all samples of a block.
    #[inline(always)]
    fn accumulate_gradients(
        parameters: &NeuralParameters<f32>,
        samples: &[Sample<f32>],
        by_parameters: &mut NeuralParameters<f32>,
    ) {
        let mut hidden = Hidden::zero(); // once for all of them: to clear it takes time
        for sample in samples {
            gradient::<f32, HIDDEN, 1, false>(parameters, sample, &mut hidden, by_parameters);
        }
    }
}
