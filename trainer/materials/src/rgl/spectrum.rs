//! Spectra and colors: the CIE 1931 standard observer and the illuminant D65, which make a gray spectrum gray.

use crate::color::FROM_XYZ;

/// The first wavelength of [`OBSERVER`], and the distance to the next one, nm.
const FIRST: f64 = 360.0;
const SPACING: f64 = 10.0;
/// The color matching functions x, y and z of the CIE 1931 observer (2 degrees), and D65 relative to 100 at 560 nm.
#[rustfmt::skip]
const OBSERVER: [[f64; 4]; 48] = [
    [0.0001, 0.0000, 0.0006, 46.64],
    [0.0004, 0.0000, 0.0019, 52.09],
    [0.0014, 0.0000, 0.0065, 49.98],
    [0.0042, 0.0001, 0.0201, 54.65],
    [0.0143, 0.0004, 0.0679, 82.75],
    [0.0435, 0.0012, 0.2074, 91.49],
    [0.1344, 0.0040, 0.6456, 93.43],
    [0.2839, 0.0116, 1.3856, 86.68],
    [0.3483, 0.0230, 1.7471, 104.87],
    [0.3362, 0.0380, 1.7721, 117.01],
    [0.2908, 0.0600, 1.6692, 117.81],
    [0.1954, 0.0910, 1.2876, 114.86],
    [0.0956, 0.1390, 0.8130, 115.92],
    [0.0320, 0.2080, 0.4652, 108.81],
    [0.0049, 0.3230, 0.2720, 109.35],
    [0.0093, 0.5030, 0.1582, 107.80],
    [0.0633, 0.7100, 0.0782, 104.79],
    [0.1655, 0.8620, 0.0422, 107.69],
    [0.2904, 0.9540, 0.0203, 104.41],
    [0.4334, 0.9950, 0.0087, 104.05],
    [0.5945, 0.9950, 0.0039, 100.00],
    [0.7621, 0.9520, 0.0021, 96.33],
    [0.9163, 0.8700, 0.0017, 95.79],
    [1.0263, 0.7570, 0.0011, 88.69],
    [1.0622, 0.6310, 0.0008, 90.01],
    [1.0026, 0.5030, 0.0003, 89.60],
    [0.8544, 0.3810, 0.0002, 87.70],
    [0.6424, 0.2650, 0.0000, 83.29],
    [0.4479, 0.1750, 0.0000, 83.70],
    [0.2835, 0.1070, 0.0000, 80.03],
    [0.1649, 0.0610, 0.0000, 80.21],
    [0.0874, 0.0320, 0.0000, 82.28],
    [0.0468, 0.0170, 0.0000, 78.28],
    [0.0227, 0.0082, 0.0000, 69.72],
    [0.0114, 0.0041, 0.0000, 71.61],
    [0.0058, 0.0021, 0.0000, 74.35],
    [0.0029, 0.0010, 0.0000, 61.60],
    [0.0014, 0.0005, 0.0000, 69.89],
    [0.0007, 0.0002, 0.0000, 75.09],
    [0.0003, 0.0001, 0.0000, 63.59],
    [0.0002, 0.0001, 0.0000, 46.42],
    [0.0001, 0.0000, 0.0000, 66.81],
    [0.0000, 0.0000, 0.0000, 63.38],
    [0.0000, 0.0000, 0.0000, 64.30],
    [0.0000, 0.0000, 0.0000, 59.45],
    [0.0000, 0.0000, 0.0000, 51.96],
    [0.0000, 0.0000, 0.0000, 57.44],
    [0.0000, 0.0000, 0.0000, 60.31],
];
/// The step of integrals over wavelengths, nm.
const STEP: f64 = 1.0;

/// The wavelengths of written spectra, nm.
pub(super) const WAVELENGTHS: [f32; 15] = [
    360.0, 400.0, 425.0, 450.0, 475.0, 500.0, 525.0, 550.0, 575.0, 600.0, 625.0, 650.0, 675.0,
    700.0, 830.0,
];
/// Three reflectances, 0 to 1, whose colors are pure red, green and blue, and whose sum is 1: the smoothest ones that are
/// linear between [`WAVELENGTHS`].
#[rustfmt::skip]
pub(super) const PRIMARIES: [[f32; 3]; 15] = [
    [0.0000, 0.0000, 1.0000],
    [0.0000, 0.0000, 1.0000],
    [0.0139, 0.0000, 0.9861],
    [0.0000, 0.0000, 1.0000],
    [0.0557, 0.1060, 0.8383],
    [0.0000, 0.7908, 0.2092],
    [0.0000, 1.0000, 0.0000],
    [0.0000, 1.0000, 0.0000],
    [0.0000, 0.9509, 0.0491],
    [0.8433, 0.1483, 0.0084],
    [1.0000, 0.0000, 0.0000],
    [1.0000, 0.0000, 0.0000],
    [1.0000, 0.0000, 0.0000],
    [1.0000, 0.0000, 0.0000],
    [1.0000, 0.0000, 0.0000],
];

/// Returns the weights of the values of a spectrum in linear RGB. `wavelengths` are its nodes in nm, in ascending order. The
/// spectrum is linear between them and constant outside.
pub(super) fn rgb_weights(wavelengths: &[f32]) -> Vec<[f64; 3]> {
    let mut weights = vec![[0.0; 3]; wavelengths.len()];
    let last = FIRST + SPACING * (OBSERVER.len() - 1) as f64;
    let steps = ((last - FIRST) / STEP) as usize;
    for step in 0..=steps {
        let wavelength = FIRST + STEP * step as f64;
        let [x, y, z, light] = observer(wavelength);
        let after = wavelengths.partition_point(|node| f64::from(*node) <= wavelength);
        let [low, high] = [after.saturating_sub(1), after.min(wavelengths.len() - 1)];
        let [from, to] = [low, high].map(|node| f64::from(wavelengths[node]));
        let share = match to > from {
            true => ((wavelength - from) / (to - from)).clamp(0.0, 1.0),
            false => 0.0,
        };
        for (channel, row) in FROM_XYZ.iter().enumerate() {
            let value = light * (row[0] * x + row[1] * y + row[2] * z);
            weights[low][channel] += (1.0 - share) * value;
            weights[high][channel] += share * value;
        }
    }
    for channel in 0..3 {
        let sum: f64 = weights.iter().map(|weight| weight[channel]).sum();
        weights.iter_mut().for_each(|weight| weight[channel] /= sum);
    }
    weights
}

/// Returns the row of [`OBSERVER`] at a wavelength within its range, interpolated linearly.
fn observer(wavelength: f64) -> [f64; 4] {
    let position = (wavelength - FIRST) / SPACING;
    let low = (position as usize).min(OBSERVER.len() - 2);
    let share = position - low as f64;
    std::array::from_fn(|i| (1.0 - share) * OBSERVER[low][i] + share * OBSERVER[low + 1][i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_have_pure_colors_and_add_up_to_white() {
        let weights = rgb_weights(&WAVELENGTHS);
        for primary in 0..3 {
            for channel in 0..3 {
                let terms = weights.iter().zip(&PRIMARIES);
                let sum: f64 = terms
                    .map(|(weight, values)| weight[channel] * f64::from(values[primary]))
                    .sum();
                let expected = if primary == channel { 1.0 } else { 0.0 };
                assert!((sum - expected).abs() < 2e-3, "{primary} {channel}: {sum}");
            }
        }
        for values in PRIMARIES {
            assert!((values.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(values.iter().all(|value| (0.0..=1.0).contains(value)));
        }
    }

    /// Light of one wavelength at 450, 550 and 650 nm looks blue, green and red.
    #[test]
    fn narrow_spectra_have_their_colors() {
        let wavelengths: Vec<f32> = (0..=48).map(|step| 360.0 + 10.0 * step as f32).collect();
        let weights = rgb_weights(&wavelengths);
        for (node, brightest) in [(9, 2), (19, 1), (29, 0)] {
            let weight = weights[node];
            assert!(
                weight.iter().all(|other| *other <= weight[brightest]),
                "{weight:?}"
            );
        }
        // The weights do not depend on additional nodes, if the spectrum is linear between the others.
        let coarse = rgb_weights(&[400.0, 700.0]);
        let fine = rgb_weights(&[400.0, 500.0, 700.0]);
        for channel in 0..3 {
            let sum: f64 = fine[1][channel] / 3.0 + fine[2][channel];
            assert!((coarse[1][channel] - sum).abs() < 1e-9);
        }
    }
}
