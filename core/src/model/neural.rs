//! The neural model.

use super::kernel::Active;
use super::{Model, ModelKind, Objective};
use crate::geometry::HalfDifference;
use crate::numeric::{Scalar, Value};

/// Units of each hidden layer.
const HIDDEN: usize = 21;
/// Number of units that are computed together. If a scalar fills a register, this many stay in registers.
const TILE: usize = 3;

/// The neural model of Sztrajman et al. (2021): 6-21-21-3, ReLU, 675 parameters.
///
/// f = max(exp(z) - 1, 0), where z is the output of a multi-layer perceptron. Its input is the unit half vector and
/// the unit difference vector, (hx, hy, hz, dx, dy, dz). (Paper, "Models: Neural networks".)
///
/// The parameters are the weights (6 x 21, inputs by outputs) and biases (21) of the first layer, the weights (21 x 21)
/// and biases (21) of the second layer, and the weights (21 x 3) and biases (3) of the output layer.
///
/// The model is isotropic because of its input. It is not reciprocal: exchanging light and sensor adds pi to phi_d and
/// turns the difference vector into (-dx, -dy, dz), which the network learns only from training materials. The mean of
/// f(i, o) and f(o, i) is reciprocal.
///
/// At theta_h = 0 the network would depend on phi_d, so phi_d is set to 0 there for both orders of the directions.
#[derive(Clone, Copy, Debug)]
pub struct Neural;

impl Neural {
    /// Number of parameters of the output layer, in triples of red, green and blue.
    pub(crate) const COLORS: usize = 3 * (HIDDEN + 1);
    /// Numbers of parameters: weights and bias of the first layer, of the second layer, and of the output layer.
    pub const LAYERS: [usize; 6] = [6 * HIDDEN, HIDDEN, HIDDEN * HIDDEN, HIDDEN, HIDDEN * 3, 3];
}

/// Number of parameters.
const PARAMETERS: usize = 6 * HIDDEN + HIDDEN + HIDDEN * HIDDEN + HIDDEN + HIDDEN * 3 + 3;

/// A value for each parameter of the network: the weights of the first layer (6 x 21, inputs by outputs), its bias
/// (21), the weights (21 x 21) and bias of the second layer, and the weights (21 x 3) and bias (3) of the output layer.
///
/// Row 1 of the first layer belongs to hy, which is always 0. It has no effect and no gradient.
pub type NeuralParameters<T> = [T; PARAMETERS];

/// Defines references to the layers of a network or a gradient. The arguments are the slice methods that split the
/// parameters, for shared or for mutable references.
macro_rules! layers {
    ($name:ident, $split_at:ident, $split_first:ident, $as_chunks:ident, $first:ident $(, $mut:ident)?) => {
        struct $name<'a, T> {
            fc1: &'a $($mut)? [[T; HIDDEN]; 6],
            b1: &'a $($mut)? [T; HIDDEN],
            fc2: &'a $($mut)? [[T; HIDDEN]; HIDDEN],
            b2: &'a $($mut)? [T; HIDDEN],
            fc3: &'a $($mut)? [[T; 3]; HIDDEN],
            b3: &'a $($mut)? [T; 3],
        }

        impl<'a, T> $name<'a, T> {
            /// Splits the parameters into layers. It never returns None. The compiler removes the checks, because all
            /// lengths are constants.
            #[inline(always)]
            fn of(parameters: &'a $($mut)? NeuralParameters<T>) -> Option<Self> {
                let (fc1, rest) = parameters.$split_at(6 * HIDDEN)?;
                let (b1, rest) = rest.$split_first()?;
                let (fc2, rest) = rest.$split_at(HIDDEN * HIDDEN)?;
                let (b2, rest) = rest.$split_first()?;
                let (fc3, rest) = rest.$split_at(HIDDEN * 3)?;
                Some(Self {
                    fc1: fc1.$as_chunks().0.$first()?,
                    b1,
                    fc2: fc2.$as_chunks().0.$first()?,
                    b2,
                    fc3: fc3.$as_chunks().0.$first()?,
                    b3: rest.$first()?,
                })
            }
        }
    };
}
layers!(
    Layers,
    split_at_checked,
    split_first_chunk,
    as_chunks,
    first_chunk
);
layers!(
    LayersMut,
    split_at_mut_checked,
    split_first_chunk_mut,
    as_chunks_mut,
    first_chunk_mut,
    mut
);

/// Computes a layer: bias + inputs * weights, followed by a ReLU with `RELU`. The options are constants, because
/// functions as arguments are not inlined where SIMD lanes are compiled.
///
/// `inputs` yields each input with its row of weights. It borrows them, because it is cloned for each tile of `TILE`
/// outputs.
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

/// The gradient with respect to some inputs of a layer: their rows of weights times the gradient with respect to the
/// outputs.
#[inline(always)]
fn by_inputs<S: Scalar, const ROWS: usize, const OUTPUTS: usize>(
    rows: [&[S::Parameter; OUTPUTS]; ROWS],
    by_outputs: &[S; OUTPUTS],
) -> [S; ROWS] {
    let mut sums = [S::constant(0.0); ROWS];
    for (column, by_output) in by_outputs.iter().enumerate() {
        for (sum, row) in sums.iter_mut().zip(&rows) {
            if let Some(weight) = row.get(column) {
                *sum = sum.plus_product(*by_output, S::broadcast(*weight));
            }
        }
    }
    sums
}

/// Propagates derivatives from a layer's outputs, `by_outputs`, to its weights and its inputs, `units`. Adds those of
/// the weights to `by_weights`. Replaces the activations in `units` by the derivatives with respect to the units, and
/// adds these to `by_biases`, the gradient of the units' biases.
///
/// An inactive unit has no gradient: its row is skipped, or its gradient is set to 0.
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
            *block = by_units; // the only unit of the block is active
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

/// The activations of both hidden layers. Later, the gradient replaces them, so that a microcontroller's stack holds
/// only one copy.
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

/// Runs the network. Sets the activations of both hidden layers, and returns the output before its activation.
#[inline(always)]
fn forward<S: Scalar, const TILE: usize>(
    layers: &Layers<'_, S::Parameter>,
    at: &HalfDifference<S>,
    hidden: &mut Hidden<S>,
) -> [S; 3] {
    let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = layers.fc1;
    let inputs = [
        (&at.hx, row_hx),
        (&at.hz, row_hz),
        (&at.dx, row_dx),
        (&at.dy, row_dy),
        (&at.dz, row_dz),
    ];
    let Hidden { first, second } = hidden;
    affine::<_, HIDDEN, TILE, true>(inputs.iter().copied(), layers.b1, first);
    affine::<_, HIDDEN, TILE, true>(first.iter().zip(layers.fc2), layers.b2, second);
    let mut output = [S::constant(0.0); 3];
    affine::<_, 3, 3, false>(second.iter().zip(layers.fc3), layers.b3, &mut output);
    output
}

/// Adds the gradient of an objective with respect to the parameters to `gradient`. With `SAMPLE`, the result is the
/// gradient with respect to the coordinates.
#[inline(always)]
fn gradient<
    S: Scalar,
    F: Objective<S>,
    const TILE: usize,
    const ROWS: usize,
    const SAMPLE: bool,
>(
    layers: &Layers<'_, S::Parameter>,
    at: &HalfDifference<S>,
    objective: &mut F,
    hidden: &mut Hidden<S>,
    gradient: &mut LayersMut<'_, S::Sum>,
) -> HalfDifference<S> {
    let (zero, one) = (S::constant(0.0), S::constant(1.0));
    let mut modeled = forward::<S, TILE>(layers, at, hidden);
    for f in &mut modeled {
        *f = f.exp() - one;
        if F::CLAMPED {
            *f = f.relu();
        }
    }
    let (by_modeled, by_cosine) = objective.derivatives(modeled, at.cos_theta_i());

    // d f / d z = exp(z) = f + 1, unless f is clamped.
    let mut by_output = by_modeled;
    for (by_z, f) in by_output.iter_mut().zip(modeled) {
        let slope = *by_z * (f + one);
        *by_z = match F::CLAMPED {
            true => f.if_positive(slope, zero),
            false => slope,
        };
    }
    S::add_all(gradient.b3, &by_output);
    let Hidden { first, second } = hidden;
    backward::<S, HIDDEN, 3, ROWS>(layers.fc3, &by_output, second, gradient.fc3, gradient.b2);
    backward::<S, HIDDEN, HIDDEN, ROWS>(layers.fc2, second, first, gradient.fc2, gradient.b1);
    let by_first = first;
    let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = gradient.fc1;
    S::add_outer_product(
        [row_hx, row_hz, row_dx, row_dy, row_dz],
        [at.hx, at.hz, at.dx, at.dy, at.dz],
        by_first,
    );

    if SAMPLE {
        let [row_hx, _, row_hz, row_dx, row_dy, row_dz] = layers.fc1;
        let [hx, hz, dx, dy, dz] = by_inputs([row_hx, row_hz, row_dx, row_dy, row_dz], by_first);
        return HalfDifference {
            hx: hx - by_cosine * at.dx,
            hz: hz + by_cosine * at.dz,
            dx: dx - by_cosine * at.hx,
            dy,
            dz: dz + by_cosine * at.hz,
        };
    }
    HalfDifference::zero()
}

impl Model for Neural {
    const KIND: ModelKind = ModelKind::Neural;
    const PARAMETERS: usize = PARAMETERS;
    type Parameters<T: Value> = NeuralParameters<T>;
    #[inline(always)]
    fn brdf<S: Scalar>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        let mut brdf = Self::unclamped_brdf(parameters, at);
        for f in &mut brdf {
            *f = f.relu();
        }
        brdf
    }

    #[inline(always)]
    fn unclamped_brdf<S: Scalar>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3] {
        let Some(layers) = Layers::of(parameters) else {
            return [S::constant(0.0); 3];
        };
        let mut hidden = Hidden::zero();
        // A small tile on devices, too: it takes a third of the flash, and the speed of evaluations matters less.
        let mut brdf = forward::<S, TILE>(&layers, at, &mut hidden);
        for f in &mut brdf {
            *f = f.exp() - S::constant(1.0);
        }
        brdf
    }

    #[inline(always)]
    fn accumulate_objective<S: Scalar, F: Objective<S>, const SAMPLE: bool>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
        objective: &mut F,
        by_parameters: &mut NeuralParameters<S::Sum>,
    ) -> HalfDifference<S> {
        let layers = Layers::of(parameters).zip(LayersMut::of(by_parameters));
        let Some((layers, mut by_layers)) = layers else {
            return HalfDifference::zero();
        };
        let mut hidden = Hidden::zero();
        let (hidden, by_layers) = (&mut hidden, &mut by_layers);
        if S::SKIPS_ZEROS {
            gradient::<S, F, HIDDEN, 1, SAMPLE>(&layers, at, objective, hidden, by_layers)
        } else {
            gradient::<S, F, TILE, TILE, SAMPLE>(&layers, at, objective, hidden, by_layers)
        }
    }

    /// The output layer: 21 weights and a bias for each channel. f is linear in them before the exponential.
    const ACTIVE: Active = Active::PerChannel {
        first: PARAMETERS - Self::COLORS,
        count: HIDDEN + 1,
    };

    #[inline(always)]
    fn jacobian<S: Scalar<Sum = S>>(
        parameters: &NeuralParameters<S::Parameter>,
        at: &HalfDifference<S>,
        rows: [&mut [S]; 3],
    ) -> [S; 3] {
        let one = S::constant(1.0);
        let Some(layers) = Layers::of(parameters) else {
            return [S::constant(0.0); 3];
        };
        let mut hidden = Hidden::zero();
        let mut modeled = forward::<S, TILE>(&layers, at, &mut hidden);
        for (f, row) in modeled.iter_mut().zip(rows) {
            let by_output = f.exp();
            *f = by_output - one;
            let units = hidden.second.iter().chain(core::iter::once(&one));
            for (entry, unit) in row.iter_mut().zip(units) {
                *entry = by_output * *unit;
            }
        }
        modeled
    }
}
