//! The formulas of `docs/recipe.md`, directly in f64.

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
    let samples = readings.iter().zip(&contents.center).zip(cosines(recipe));
    let network_inputs = samples.map(|((reading, center), w)| {
        reading.map(|brdf| {
            brdf.map(|y| {
                let logarithm = ((f64::from(y) * w + 0.001) / 0.001).ln();
                (logarithm - f64::from(*center)) * f64::from(contents.scale) * gain
            })
        })
    });
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
    let (_, init_net_part) = contents.descent.as_ref().unwrap();
    let a = coefficients.concat();
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
    let (_, init_net_part) = contents.descent.as_ref().unwrap();
    let units: Vec<f64> = units.iter().map(|unit| rounded(*unit)).collect();
    let rows = init_net_part.output_scales.iter().enumerate();
    rows.map(|(parameter, scale)| {
        let row = &init_net_part.output[parameter * units.len()..][..units.len()];
        dot(row, &units) * f64::from(*scale)
    })
    .collect()
}

/// The values of a fit without descent: Linear's coefficients, or the initial values of a descent.
pub(crate) fn expected_values(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    readings: &Readings,
) -> Vec<f64> {
    let coefficients = coefficients(contents, &network_inputs(contents, recipe, readings));
    let Some((descent_part, _)) = &contents.descent else {
        return coefficients.concat();
    };
    let offsets = offsets(contents, &units(contents, &coefficients));
    let pairs = descent_part.initial.iter().zip(offsets);
    pairs
        .map(|(phi, offset)| f64::from(*phi) + offset)
        .collect()
}

/// Linear's residual at each sample with a reading: the cosine-weighted logarithmic error.
pub(crate) fn residuals(
    contents: &CompletedContents,
    recipe: &Recipe<'_>,
    coefficients: &[f64],
    readings: &Readings,
) -> Vec<Option<f64>> {
    let m = contents.components;
    let samples = recipe.directions().zip(cosines(recipe)).zip(readings);
    let residuals = samples.map(|(((sample, directions), w), reading)| {
        let (sample, cosine) = (usize::from(sample), f64::from(directions.incoming[2]));
        reading.map(|brdf| {
            let errors = coefficients.chunks(m).zip(brdf).map(|(coefficients, y)| {
                let scales = contents.row_scales.iter().copied().map(f64::from);
                let scaled: Vec<f64> = scales.zip(coefficients).map(|(s, a)| s * a).collect();
                let mapped = dot(&contents.rows[sample * m..][..m], &scaled);
                let mapped = mapped + f64::from(contents.center[sample]);
                let f = (0.001 * (mapped.exp() - 1.0) / w).max(0.0);
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

/// Asserts that lists are equal within [`TOLERANCE`].
#[track_caller]
pub(crate) fn assert_close(name: &str, actual: impl Iterator<Item = f32>, expected: &[f64]) {
    let actual: Vec<f32> = actual.collect();
    assert_eq!(actual.len(), expected.len(), "{name}");
    for (index, (actual, expected)) in actual.iter().zip(expected).enumerate() {
        let error = (f64::from(*actual) - expected).abs() / expected.abs().max(1.0);
        assert!(
            error <= TOLERANCE,
            "{name} {index}: {actual} instead of {expected}, error {error:.1e}"
        );
    }
}
