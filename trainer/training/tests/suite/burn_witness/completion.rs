//! A completion, and the start that it leads to, as a program of tensor operations: logarithms of the
//! readings of many materials, products of matrices, hyperbolic tangents. All materials are one
//! matrix, a row each; core goes through them one by one and weight by weight.

mod case;
mod found;

use std::sync::PoisonError;

use burn::tensor::Tensor;

use self::case::{Case, EPSILON, Size};
use super::{Matrix, TOLERANCE, TURN, disagreement, list, matrix};

/// The largest error in single precision, relative to the largest entry of its list.
///
/// What was seen is at most 7e-7: a few roundings of 6e-8, as the longest sums have a hundred terms.
/// Other instruction sets round in another order. A term that is wrong by a hundred-thousandth of the
/// list's largest entry shows.
const SINGLE: f64 = 5e-6;

/// What comes out, and the gradient of the [score](Case::by_coefficients) by all that goes in.
struct Outcome {
    /// For each material those of red, of green, of blue.
    coefficients: Vec<f64>,
    /// theta_0 of each material; empty where there is no start, as the lists of its weights are.
    initial: Vec<f64>,
    /// By weights, in the order of [`Case::weights`].
    by_weights: [Vec<f64>; 6],
    /// By the logarithm of each reading times both cosines, plus e: for each material three channels of
    /// each sample, 0 where it is missing.
    by_readings: Vec<f64>,
}

/// What the lists of an outcome are called.
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
        let [readings, bias, output, hidden, start_bias, start_output] = &self.by_weights;
        [
            &self.coefficients,
            &self.initial,
            readings,
            bias,
            output,
            hidden,
            start_bias,
            start_output,
            &self.by_readings,
        ]
    }

    /// The largest disagreement of each list with what a witness found.
    fn against(&self, witnessed: &Self, tolerance: f64, what: &str) -> [f64; 9] {
        let lists = self.lists().into_iter().zip(witnessed.lists()).zip(NAMES);
        let mut errors = [0.0; 9];
        for (error, ((found, witnessed), name)) in errors.iter_mut().zip(lists) {
            let says_something = witnessed.iter().any(|entry| entry.abs() > 1e-3);
            assert!(witnessed.is_empty() || says_something, "{what}: {name}");
            *error = disagreement(found, witnessed);
            // Written so that a NaN fails as well.
            assert!(*error <= tolerance, "{what}: {name} disagree by {error:e}");
        }
        errors
    }
}

/// The coefficients of all materials, and the readings and weights that they come from.
fn complete(case: &Case) -> (Matrix, [Matrix; 3], [Matrix; 3]) {
    let Size {
        samples,
        components,
        hidden,
        ..
    } = case.size;
    let rows = components + hidden;
    let [readings, bias, output, ..] = &case.weights;
    let readings = matrix(readings, [samples, 3 * rows]).require_grad();
    let bias = matrix(bias, [1, rows]).require_grad();
    // A matrix without columns is none.
    let output = match hidden {
        0 => matrix(&[0.0], [1, 1]),
        _ => matrix(output, [components, hidden]).require_grad(),
    };
    let [own, mean, missing] = [0, 1, 2].map(|part| readings.clone().narrow(1, part * rows, rows));

    let across = [case.materials, samples];
    let absent = matrix(&case.absent(), across);
    let there = (-absent.clone()).add_scalar(1.0);
    let cosines = matrix(&case.cosines, [1, samples]);
    let center = matrix(&case.center, [1, samples]);
    let values = [0, 1, 2].map(|channel| matrix(&case.channel(channel), across).require_grad());
    let standardized = values.each_ref().map(|values| {
        let above = (values.clone() * cosines.clone()).add_scalar(EPSILON);
        let logarithm = above.log().sub_scalar(EPSILON.ln());
        (logarithm - center.clone()) * case.scale * there.clone()
    });
    let [red, green, blue] = standardized.clone();
    let shared = (red + green + blue).matmul(mean) * (1.0 / 3.0) + absent.matmul(missing);
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

/// theta_0 of all materials, and the weights that it comes from.
fn start(case: &Case, coefficients: Matrix) -> (Matrix, [Matrix; 3]) {
    let Size {
        components,
        units,
        parameters,
        ..
    } = case.size;
    let [_, _, _, hidden, bias, output] = &case.weights;
    let hidden = matrix(hidden, [units, 3 * components]).require_grad();
    let bias = matrix(bias, [1, units]).require_grad();
    let output = matrix(output, [parameters, units]).require_grad();
    let initial = matrix(&case.initial, [1, parameters]);
    let activations = (coefficients.matmul(hidden.clone().transpose()) + bias.clone()).tanh();
    let initial = initial + activations.matmul(output.clone().transpose());
    (initial, [hidden, bias, output])
}

fn witness(case: &Case) -> Outcome {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let (coefficients, values, completion_options) = complete(case);
    let scored = |values: &Matrix, weights: &[f64]| {
        let weights = matrix(weights, values.dims());
        (values.clone() * values.clone() * weights).sum() * 0.5
    };
    let mut score = scored(&coefficients, &case.by_coefficients);
    let mut initial = Vec::new();
    let mut starting = None;
    if case.size.units > 0 {
        let (theta, weights) = start(case, coefficients.clone());
        score = score + scored(&theta, &case.by_initial);
        initial = list(theta);
        starting = Some(weights);
    }

    let gradients = score.backward();
    let slopes = |tensor: &Matrix| match tensor.grad(&gradients) {
        Some(slopes) => list(slopes),
        // A matrix that is none has no slopes.
        None => Vec::new(),
    };
    let [readings, bias, output] = completion_options.each_ref().map(slopes);
    let [hidden, start_bias, start_output] = match &starting {
        Some(weights) => weights.each_ref().map(slopes),
        None => [const { Vec::new() }; 3],
    };
    Outcome {
        coefficients: list(coefficients),
        initial,
        by_weights: [readings, bias, output, hidden, start_bias, start_output],
        by_readings: case.by_logarithms(&values.each_ref().map(slopes)),
    }
}

/// Compares some sizes of a completion, with all readings and with some.
fn compare(sizes: &[Size]) {
    let mut largest = [[0.0_f64; 9]; 3];
    for size in sizes {
        for missing in [0.0, 0.4] {
            let case = Case::new(*size, missing);
            let witnessed = witness(&case);
            let found = [
                ("core, f64", found::one_by_one::<f64>(&case), TOLERANCE),
                ("core, f32", found::one_by_one::<f32>(&case), SINGLE),
                ("on lanes", found::side_by_side(&case), SINGLE),
            ];
            for (largest, (name, found, tolerance)) in largest.iter_mut().zip(found) {
                let what = format!("{name}, {size:?}, {missing} missing");
                let errors = found.against(&witnessed, tolerance, &what);
                *largest = std::array::from_fn(|i| largest[i].max(errors[i]));
            }
        }
    }
    for (what, largest) in ["core, f64", "core, f32", "on lanes"].iter().zip(largest) {
        for (name, error) in NAMES.iter().zip(largest) {
            println!("completion against burn, {what}: {name} {error:.1e}");
        }
    }
}

fn size(samples: usize, [components, hidden, units]: [usize; 3], parameters: usize) -> Size {
    Size {
        samples,
        components,
        hidden,
        units,
        parameters,
    }
}

#[test]
fn completions_agree_with_burn() {
    compare(&[
        size(1, [1, 0, 0], 0),
        size(1, [2, 3, 0], 0),
        size(3, [4, 0, 0], 0),
        size(3, [3, 5, 0], 0),
        size(8, [5, 9, 0], 0),
        size(8, [24, 64, 0], 0),
    ]);
}

#[test]
fn starts_agree_with_burn() {
    compare(&[
        size(1, [1, 0, 1], 7),
        size(1, [3, 2, 4], 8),
        size(3, [2, 5, 3], 7),
        size(8, [4, 9, 5], 8),
        size(8, [24, 64, 32], 7),
        size(8, [24, 64, 32], 675),
    ]);
}
