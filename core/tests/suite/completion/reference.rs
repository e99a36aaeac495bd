//! The formulas of `docs/recipe.md`, directly in f64.

use glimpse_core::fit::coefficient_net::MAX_RMS;
use glimpse_core::recipe::Recipe;

use super::contents::CompletedContents;

/// Readings of red, green and blue; None if missing.
pub(crate) type Readings = Vec<Option<[f32; 3]>>;

/// The synthetic reading of a sample.
pub(crate) fn color(sample: usize) -> [f32; 3] {
    let k = sample as f32;
    [0.2 + 0.1 * k, 0.3 / (1.0 + k), 0.02 + 0.05 * k]
}

/// The readings of some of n samples.
pub(crate) fn some_readings(samples: usize, is_read: impl Fn(usize) -> bool) -> Readings {
    let samples = 0..samples;
    samples
        .map(|sample| is_read(sample).then(|| color(sample)))
        .collect()
}

/// The readings of all of n samples.
pub(crate) fn all_readings(samples: usize) -> Readings {
    some_readings(samples, |_| true)
}

/// The product of both cosines at each sample.
fn cosines(recipe: &Recipe<'_>) -> Vec<f64> {
    let cosines = recipe.directions().map(|(_, directions)| {
        f64::from(directions.incoming[2]) * f64::from(directions.outgoing[2])
    });
    cosines.collect()
}

fn dot(weights: &[i8], values: &[f64]) -> f64 {
    let terms = weights.iter().zip(values);
    terms.map(|(w, value)| f64::from(*w) * value).sum()
}

/// ln((y w + e) / e) - center of each channel of the present readings.
fn centered_logarithms(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> Vec<Option<[f64; 3]>> {
    let samples = readings.iter().zip(&contents.center).zip(cosines(recipe));
    let logarithms = samples.map(|((reading, center), w)| {
        reading.map(|brdf| {
            brdf.map(|y| ((f64::from(y) * w + 0.001) / 0.001).ln() - f64::from(*center))
        })
    });
    logarithms.collect()
}

/// u_ic of each sample with a reading, times the dropout gain.
pub(crate) fn network_inputs(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> Vec<Option<[f64; 3]>> {
    let present = readings.iter().flatten().count() as f64;
    let gain = match contents.missing {
        2 => (readings.len() as f64 / present).sqrt(),
        _ => 1.0,
    };
    let factor = f64::from(contents.scale) * gain;
    let logarithms = centered_logarithms(contents, recipe, readings).into_iter();
    let network_inputs = logarithms.map(|u| u.map(|channels| channels.map(|x| x * factor)));
    network_inputs.collect()
}

/// An activation, rounded to an integer of 16 bits.
fn rounded(activation: f64) -> f64 {
    (activation * 32_767.0).round() / 32_767.0
}

/// The coefficients of each channel.
pub(crate) fn coefficients(
    contents: &CompletedContents,
    network_inputs: &[Option<[f64; 3]>],
) -> [Vec<f64>; 3] {
    let (m, h) = (contents.components, contents.hidden());
    let rows = m + h;
    let weight = |sample: usize, column: usize, row: usize| {
        let byte = contents.readings[(sample * 3 + column) * rows + row];
        f64::from(byte) * f64::from(contents.reading_scales[row])
    };
    [0, 1, 2].map(|channel| {
        let z: Vec<f64> = (0..rows)
            .map(|row| {
                let mut z = f64::from(contents.bias[row]);
                for (sample, u) in network_inputs.iter().enumerate() {
                    z += match u {
                        Some(u) => {
                            let mean = (u[0] + u[1] + u[2]) / 3.0;
                            weight(sample, 0, row) * u[channel] + weight(sample, 1, row) * mean
                        }
                        None => weight(sample, 2, row),
                    };
                }
                z
            })
            .collect();
        let hidden: Vec<f64> = z[m..].iter().map(|z| rounded(z.tanh())).collect();
        (0..m)
            .map(|k| {
                let sum = dot(&contents.output[k * h..][..h], &hidden);
                z[k] + f64::from(contents.output_scales[k]) * sum
            })
            .collect()
    })
}

/// The units tanh(P a + p).
pub(crate) fn units(contents: &CompletedContents, coefficients: &[Vec<f64>; 3]) -> Vec<f64> {
    let init_net_part = contents.init_net.as_ref().unwrap();
    let mut a = coefficients.concat();
    let squares: f64 = a.iter().map(|a| a * a).sum();
    let rms = (squares / a.len() as f64).sqrt();
    let factor = (MAX_RMS / rms).min(1.0);
    for entry in &mut a {
        *entry *= factor;
    }
    let rows = init_net_part
        .bias
        .iter()
        .zip(&init_net_part.hidden_scales)
        .enumerate();
    rows.map(|(unit, (bias, scale))| {
        let sum = dot(&init_net_part.hidden[unit * a.len()..][..a.len()], &a);
        (sum * f64::from(*scale) + f64::from(*bias)).tanh()
    })
    .collect()
}

/// The offsets, U times the units.
pub(crate) fn offsets(contents: &CompletedContents, units: &[f64]) -> Vec<f64> {
    let init_net_part = contents.init_net.as_ref().unwrap();
    let units: Vec<f64> = units.iter().map(|unit| rounded(*unit)).collect();
    let rows = init_net_part.output_scales.iter().enumerate();
    rows.map(|(parameter, scale)| {
        let row = &init_net_part.output[parameter * units.len()..][..units.len()];
        dot(row, &units) * f64::from(*scale)
    })
    .collect()
}

/// Solves a linear system by Gaussian elimination.
pub(crate) fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let order = right.len();
    for pivot in 0..order {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        let pivot_row = &above[pivot];
        for (index, row) in below.iter_mut().enumerate() {
            let factor = row[pivot] / pivot_row[pivot];
            for (entry, other) in row.iter_mut().zip(pivot_row) {
                *entry -= factor * other;
            }
            right[pivot + 1 + index] -= factor * right[pivot];
        }
    }
    for row in (0..order).rev() {
        for column in row + 1..order {
            right[row] -= matrix[row][column] * right[column];
        }
        right[row] /= matrix[row][row];
    }
    right
}

/// The components of a row of weights, times their scales.
pub(crate) fn scaled(weights: &[i8], scales: &[f32], row: usize) -> Vec<f64> {
    let entries = weights[row * scales.len()..].iter().zip(scales);
    let scaled = entries.map(|(weight, scale)| f64::from(*weight) * f64::from(*scale));
    scaled.collect()
}

/// Adds a row of a least-squares problem to the normal equations.
pub(crate) fn add_row(
    matrix: &mut [Vec<f64>],
    right: &mut [f64],
    row: &[f64],
    weight: f64,
    residual: f64,
) {
    for ((line, entry), left) in matrix.iter_mut().zip(right).zip(row) {
        *entry += weight * left * residual;
        for (sum, other) in line.iter_mut().zip(row) {
            *sum += weight * left * other;
        }
    }
}

/// A diagonal matrix.
pub(crate) fn diagonal(entries: &[f32]) -> Vec<Vec<f64>> {
    let mut matrix = vec![vec![0.0; entries.len()]; entries.len()];
    for (index, entry) in entries.iter().enumerate() {
        matrix[index][index] = f64::from(*entry);
    }
    matrix
}

/// The coefficients of each channel, corrected if the recipe has a correction.
pub(crate) fn fitted_coefficients(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> [Vec<f64>; 3] {
    let mut coefficients = coefficients(contents, &network_inputs(contents, recipe, readings));
    let Some(correction_part) = &contents.correction else {
        return coefficients;
    };
    let logarithms = centered_logarithms(contents, recipe, readings);
    for (channel, a) in coefficients.iter_mut().enumerate() {
        a.resize(correction_part.precision.len(), 0.0);
        let mut matrix = diagonal(&correction_part.precision);
        let mut right = vec![0.0; a.len()];
        for (sample, logarithm) in logarithms.iter().enumerate() {
            if let Some(logarithm) = logarithm {
                let row = scaled(&correction_part.rows, &correction_part.row_scales, sample);
                let predicted: f64 = row.iter().zip(&*a).map(|(q, a)| q * a).sum();
                let residual = logarithm[channel] - predicted;
                add_row(&mut matrix, &mut right, &row, 1.0, residual);
            }
        }
        for (a, z) in a.iter_mut().zip(solve(matrix, right)) {
            *a += z;
        }
    }
    coefficients
}

/// s, the mean of |r| over the present readings and channels. The recipe has a correction.
pub(crate) fn innovation(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> f64 {
    let correction_part = contents.correction.as_ref().unwrap();
    let coefficients = coefficients(contents, &network_inputs(contents, recipe, readings));
    let logarithms = centered_logarithms(contents, recipe, readings);
    let (mut sum, mut count) = (0.0, 0);
    for (sample, logarithms) in logarithms.iter().enumerate() {
        for (logarithm, a) in logarithms.iter().flatten().zip(&coefficients) {
            let row = scaled(&correction_part.rows, &correction_part.row_scales, sample);
            let predicted: f64 = row.iter().zip(a).map(|(q, a)| q * a).sum();
            sum += (logarithm - predicted).abs();
            count += 1;
        }
    }
    sum / f64::from(count)
}

/// The values of a fit without steps: Linear's coefficients, or the initial values of a descent or of Gauss-Newton steps.
pub(crate) fn expected_values(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> Vec<f64> {
    let coefficients = fitted_coefficients(contents, recipe, readings);
    if contents.init_net.is_none() {
        return coefficients.concat();
    }
    let offsets = offsets(contents, &units(contents, &coefficients));
    let pairs = contents.initial().iter().zip(offsets);
    pairs
        .map(|(phi, offset)| f64::from(*phi) + offset)
        .collect()
}

/// The BRDF of coefficients at directions with the product `w` of both cosines, or 0 if it is negative.
pub(crate) fn brdf_of(row: &[f64], center: f32, coefficients: &[f64], w: f64) -> f64 {
    let products = row.iter().zip(coefficients).map(|(entry, a)| entry * a);
    let mapped = f64::from(center) + products.sum::<f64>();
    (0.001 * (mapped.exp() - 1.0) / w).max(0.0)
}

/// Linear's residual at each sample with a reading: the cosine-weighted logarithmic error.
pub(crate) fn residuals(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    coefficients: &[f64],
    readings: &Readings,
) -> Vec<Option<f64>> {
    let (rows, scales) = match &contents.correction {
        Some(correction_part) => (&correction_part.rows, &correction_part.row_scales),
        None => (&contents.rows, &contents.row_scales),
    };
    let samples = recipe.directions().zip(cosines(recipe)).zip(readings);
    let residuals = samples.map(|(((sample, directions), w), reading)| {
        let (sample, cosine) = (usize::from(sample), f64::from(directions.incoming[2]));
        reading.map(|brdf| {
            let channels = coefficients.chunks(scales.len());
            let errors = channels.zip(brdf).map(|(coefficients, y)| {
                let row = scaled(rows, scales, sample);
                let f = brdf_of(&row, contents.center[sample], coefficients, w);
                ((1.0 + f * cosine) / (1.0 + f64::from(y) * cosine))
                    .ln()
                    .abs()
            });
            errors.sum::<f64>() / 3.0
        })
    });
    residuals.collect()
}

/// The largest error of f32 compared with f64, relative to the larger of 1 and the number. micromath is less accurate.
pub(crate) const TOLERANCE: f64 = if cfg!(feature = "micromath") {
    2e-2
} else {
    2e-6
};

/// The largest error of values that depend on the solution of a system.
///
/// A residual has an error of about 1e-6 in f32: that of the coefficients or parameters, and of a logarithm. With micromath
/// it is 5e-4, due to exponentials with an error of 2.4e-3. A system with precisions from p multiplies it by at most
/// 1 / (2 sqrt(p)), which is 5 for p = 0.01. Rounding in the solution adds the product of condition number, up to 200, and
/// 6e-8.
pub(crate) const SYSTEM_TOLERANCE: f64 = if cfg!(feature = "micromath") {
    5e-3
} else {
    1e-5
};

/// Asserts that lists are equal within [`TOLERANCE`].
#[track_caller]
pub(crate) fn assert_close(name: &str, actual: impl Iterator<Item = f32>, expected: &[f64]) {
    assert_within(TOLERANCE, name, actual, expected);
}

/// Asserts that lists are equal within a tolerance, relative to the larger of 1 and the number.
#[track_caller]
pub(crate) fn assert_within(
    tolerance: f64,
    name: &str,
    actual: impl Iterator<Item = f32>,
    expected: &[f64],
) {
    let actual: Vec<f32> = actual.collect();
    assert_eq!(actual.len(), expected.len(), "{name}");
    for (index, (actual, expected)) in actual.iter().zip(expected).enumerate() {
        let error = (f64::from(*actual) - expected).abs() / expected.abs().max(1.0);
        assert!(
            error <= tolerance,
            "{name} {index}: {actual} instead of {expected}, error {error:.1e}"
        );
    }
}
