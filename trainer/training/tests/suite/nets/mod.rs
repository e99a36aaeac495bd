//! The coefficient net and the start net of batches on lanes, compared with core in double precision. Core's own tests
//! compare its nets with a reference, and their adjoints with forward mode.

mod case;
mod implementation;

use glimpse_kernels::completion::Shape;

use self::case::Case;

/// The largest permitted error in single precision, relative to the largest entry of the list.
///
/// The largest observed error is 7e-7, the rounding error (6e-8 each) of sums of up to about 100 terms. It differs
/// between instruction sets, which add in a different order. The test detects terms that are wrong by 1e-5 of the
/// largest entry.
const TOLERANCE: f64 = 5e-6;

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
    fn compare(&self, expected: &Self, context: &str) -> [f64; 9] {
        let lists = self.lists().into_iter().zip(expected.lists()).zip(NAMES);
        let mut errors = [0.0; 9];
        for (error, ((actual, expected), name)) in errors.iter_mut().zip(lists) {
            // The comparison of zeros would test nothing.
            let is_nonzero = expected.iter().any(|entry| entry.abs() > 1e-3);
            assert!(expected.is_empty() || is_nonzero, "{context}: {name}");
            *error = relative_error(actual, expected);
            // This form also fails for NaN.
            assert!(
                *error <= TOLERANCE,
                "{context}: {name}: relative error {error:e}"
            );
        }
        errors
    }
}

/// Compares nets of several sizes, with all readings and with missing ones.
fn compare(shapes: &[Shape]) {
    let mut largest = [0.0_f64; 9];
    for shape in shapes {
        for missing in [0.0, 0.4] {
            let case = Case::new(*shape, missing);
            let context = format!("{shape:?}, {missing} missing");
            let outcome = implementation::lanes(&case);
            let errors = outcome.compare(&implementation::core(&case), &context);
            largest = std::array::from_fn(|i| largest[i].max(errors[i]));
        }
    }
    for (name, error) in NAMES.iter().zip(largest) {
        println!("nets on lanes: {name} {error:.1e}");
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
fn coefficient_net_matches_core() {
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
fn start_net_matches_core() {
    compare(&[
        shape(1, [1, 0, 1], 7),
        shape(1, [3, 2, 4], 8),
        shape(3, [2, 5, 3], 7),
        shape(8, [4, 9, 5], 8),
        shape(8, [24, 64, 32], 7),
        shape(8, [24, 64, 32], 675),
    ]);
}

/// Returns the largest difference between two lists, relative to the largest expected entry. Returns NaN if a
/// difference is NaN.
fn relative_error(actual: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(actual.len(), expected.len());
    let largest = expected
        .iter()
        .fold(0.0_f64, |max, entry| max.max(entry.abs()));
    let differences = actual.iter().zip(expected).map(|(a, b)| (a - b).abs());
    let difference = differences.fold(0.0, |max: f64, difference| {
        if difference.is_nan() {
            difference
        } else {
            max.max(difference)
        }
    });
    if difference == 0.0 {
        0.0
    } else {
        difference / largest
    }
}
