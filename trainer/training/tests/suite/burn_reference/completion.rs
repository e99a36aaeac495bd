//! The coefficient net and the start net in tensor operations: logarithms of readings, matrix products, hyperbolic
//! tangents. Each material is a row of the matrices; core processes one material after the other.

mod case;
mod implementation;

use std::sync::PoisonError;

use burn::tensor::Tensor;
use glimpse_core::fit::coefficient_net::MAX_RMS;
use glimpse_kernels::completion::Shape;

use self::case::{Case, EPSILON};
use super::{BURN_LOCK, Matrix, TOLERANCE, matrix, relative_error, to_vec};

/// The largest permitted error in single precision, relative to the largest entry of the list.
///
/// The largest observed error is 7e-7, the rounding error (6e-8 each) of sums of up to about 100 terms. It differs
/// between instruction sets, which add in a different order. The test detects terms that are wrong by 1e-5 of the
/// largest entry.
const F32_TOLERANCE: f64 = 5e-6;

/// The outputs, and the gradient of the [score](Case::coefficient_score_weights) with respect to all inputs.
struct Outcome {
    /// The coefficients of each material: red, green, blue.
    coefficients: Vec<f64>,
    /// theta_0 of each material; empty without an start net.
    initial: Vec<f64>,
    /// The gradient with respect to the weights, in the order of [`Case::weights`].
    by_weights: [Vec<f64>; 6],
    /// The gradient with respect to ln(y w + e) of each reading y: three channels of each sample of each material, 0
    /// for missing readings.
    by_readings: Vec<f64>,
}

/// The names of the lists of an outcome.
const NAMES: [&str; 9] = [
    "coefficients",
    "theta_0",
    "by readings' weights",
    "by bias",
    "by W",
    "by P",
    "by p",
    "by U",
    "by readings",
];

impl Outcome {
    fn lists(&self) -> [&[f64]; 9] {
        let [readings, bias, output, hidden, init_bias, init_output] = &self.by_weights;
        [
            &self.coefficients,
            &self.initial,
            readings,
            bias,
            output,
            hidden,
            init_bias,
            init_output,
            &self.by_readings,
        ]
    }

    /// Asserts that each list matches the reference, and returns the relative errors.
    fn compare(&self, expected: &Self, tolerance: f64, context: &str) -> [f64; 9] {
        let lists = self.lists().into_iter().zip(expected.lists()).zip(NAMES);
        let mut errors = [0.0; 9];
        for (error, ((actual, expected), name)) in errors.iter_mut().zip(lists) {
            // The comparison of zeros would test nothing.
            let is_nonzero = expected.iter().any(|entry| entry.abs() > 1e-3);
            assert!(expected.is_empty() || is_nonzero, "{context}: {name}");
            *error = relative_error(actual, expected);
            // This form also fails for NaN.
            assert!(
                *error <= tolerance,
                "{context}: {name}: relative error {error:e}"
            );
        }
        errors
    }
}

/// Returns the coefficients of all materials, and the readings and weights that they depend on.
fn coefficient_net(case: &Case) -> (Matrix, [Matrix; 3], [Matrix; 3]) {
    let Shape {
        samples,
        components,
        hidden,
        ..
    } = case.shape;
    let rows = components + hidden;
    let [readings, bias, output, ..] = &case.weights;
    let readings = matrix(readings, [samples, 3 * rows]).require_grad();
    let bias = matrix(bias, [1, rows]).require_grad();
    // burn has no matrices without columns.
    let output = match hidden {
        0 => matrix(&[0.0], [1, 1]),
        _ => matrix(output, [components, hidden]).require_grad(),
    };
    let [own, mean, missing] = [0, 1, 2].map(|part| readings.clone().narrow(1, part * rows, rows));

    let dims = [case.materials, samples];
    let missing_flags = matrix(&case.missing_flags(), dims);
    let present = (-missing_flags.clone()).add_scalar(1.0);
    let cosine_products = matrix(&case.cosine_products, [1, samples]);
    let center = matrix(&case.center, [1, samples]);
    let values = [0, 1, 2].map(|channel| matrix(&case.channel(channel), dims).require_grad());
    let standardized = values.each_ref().map(|values| {
        let argument = (values.clone() * cosine_products.clone()).add_scalar(EPSILON);
        let logarithm = argument.log().sub_scalar(EPSILON.ln());
        (logarithm - center.clone()) * case.scale * present.clone()
    });
    let [red, green, blue] = standardized.clone();
    let shared = (red + green + blue).matmul(mean) * (1.0 / 3.0) + missing_flags.matmul(missing);
    let coefficients = standardized.map(|values| {
        let sums = values.matmul(own.clone()) + shared.clone() + bias.clone();
        let direct = sums.clone().narrow(1, 0, components);
        match hidden {
            0 => direct,
            _ => {
                let units = sums.narrow(1, components, hidden).tanh();
                direct + units.matmul(output.clone().transpose())
            }
        }
    });
    let coefficients = Tensor::cat(coefficients.to_vec(), 1);
    (coefficients, values, [readings, bias, output])
}

/// Returns theta_0 of all materials, and the weights that it depends on.
fn start_net(case: &Case, coefficients: Matrix) -> (Matrix, [Matrix; 3]) {
    let Shape {
        components,
        units,
        parameters,
        ..
    } = case.shape;
    let [_, _, _, hidden, bias, output] = &case.weights;
    let hidden = matrix(hidden, [units, 3 * components]).require_grad();
    let bias = matrix(bias, [1, units]).require_grad();
    let output = matrix(output, [parameters, units]).require_grad();
    let initial = matrix(&case.initial, [1, parameters]);
    // Burn rounds scalars in derivatives to single precision, also those of its mean.
    let squares = (coefficients.clone() * coefficients.clone()).sum_dim(1);
    let max = MAX_RMS * MAX_RMS * (3 * components) as f64;
    let excess = (squares / matrix(&[max], [1, 1])).clamp_min(1.0);
    let coefficients = coefficients / excess.sqrt();
    let activations = (coefficients.matmul(hidden.clone().transpose()) + bias.clone()).tanh();
    let initial = initial + activations.matmul(output.clone().transpose());
    (initial, [hidden, bias, output])
}

/// Computes the outcome with the reference implementation.
fn reference(case: &Case) -> Outcome {
    let _lock = BURN_LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let (coefficients, values, coefficient_net_weights) = coefficient_net(case);
    let score_of = |values: &Matrix, weights: &[f64]| {
        let weights = matrix(weights, values.dims());
        (values.clone() * values.clone() * weights).sum() * 0.5
    };
    let mut score = score_of(&coefficients, &case.coefficient_score_weights);
    let mut initial = Vec::new();
    let mut start_net_weights = None;
    if case.shape.units > 0 {
        let (theta, weights) = start_net(case, coefficients.clone());
        score = score + score_of(&theta, &case.initial_score_weights);
        initial = to_vec(theta);
        start_net_weights = Some(weights);
    }

    let gradients = score.backward();
    let gradient = |tensor: &Matrix| match tensor.grad(&gradients) {
        Some(gradient) => to_vec(gradient),
        // A matrix without columns has no gradient.
        None => Vec::new(),
    };
    let [readings, bias, output] = coefficient_net_weights.each_ref().map(gradient);
    let [hidden, init_bias, init_output] = match &start_net_weights {
        Some(weights) => weights.each_ref().map(gradient),
        None => [const { Vec::new() }; 3],
    };
    Outcome {
        coefficients: to_vec(coefficients),
        initial,
        by_weights: [readings, bias, output, hidden, init_bias, init_output],
        by_readings: case.by_logarithms(&values.each_ref().map(gradient)),
    }
}

/// Compares nets of several sizes, with all readings and with missing ones.
fn compare(shapes: &[Shape]) {
    let mut largest = [[0.0_f64; 9]; 3];
    for shape in shapes {
        for missing in [0.0, 0.4] {
            let case = Case::new(*shape, missing);
            let expected = reference(&case);
            let outcomes = [
                ("core, f64", implementation::core::<f64>(&case), TOLERANCE),
                (
                    "core, f32",
                    implementation::core::<f32>(&case),
                    F32_TOLERANCE,
                ),
                ("on lanes", implementation::lanes(&case), F32_TOLERANCE),
            ];
            for (largest, (name, outcome, tolerance)) in largest.iter_mut().zip(outcomes) {
                let context = format!("{name}, {shape:?}, {missing} missing");
                let errors = outcome.compare(&expected, tolerance, &context);
                *largest = std::array::from_fn(|i| largest[i].max(errors[i]));
            }
        }
    }
    for (implementation, largest) in ["core, f64", "core, f32", "on lanes"].iter().zip(largest) {
        for (name, error) in NAMES.iter().zip(largest) {
            println!("completion against burn, {implementation}: {name} {error:.1e}");
        }
    }
}

fn shape(samples: usize, [components, hidden, units]: [usize; 3], parameters: usize) -> Shape {
    Shape {
        samples,
        components,
        hidden,
        units,
        parameters,
    }
}

#[test]
fn coefficient_net_matches_burn() {
    compare(&[
        shape(1, [1, 0, 0], 0),
        shape(1, [2, 3, 0], 0),
        shape(3, [4, 0, 0], 0),
        shape(3, [3, 5, 0], 0),
        shape(8, [5, 9, 0], 0),
        shape(8, [24, 64, 0], 0),
    ]);
}

#[test]
fn start_net_matches_burn() {
    compare(&[
        shape(1, [1, 0, 1], 7),
        shape(1, [3, 2, 4], 8),
        shape(3, [2, 5, 3], 7),
        shape(8, [4, 9, 5], 8),
        shape(8, [24, 64, 32], 7),
        shape(8, [24, 64, 32], 675),
    ]);
}
