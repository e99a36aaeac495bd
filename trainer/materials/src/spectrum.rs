//! Colors of spectra, by the CIE's standard observers and illuminants.

use std::ops::Range;

use crate::color::{FROM_XYZ, IDENTITY, product};
use crate::interpolation::Position;

/// A standard illuminant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Illuminant {
    /// Daylight of 6504 K, that of sRGB.
    #[default]
    D65,
    /// Daylight of 5003 K, that of print shops.
    D50,
    /// An incandescent lamp of 2856 K.
    A,
    /// Equal energy at all wavelengths.
    E,
}

/// A standard observer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Observer {
    /// CIE 1931, for fields of 2 degrees.
    #[default]
    #[value(name = "2")]
    Cie1931,
    /// CIE 1964, for fields of 10 degrees.
    #[value(name = "10")]
    Cie1964,
}

/// The conditions of a color.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Viewing {
    /// The light.
    pub illuminant: Illuminant,
    /// The eye.
    pub observer: Observer,
}

/// The first wavelength of [`OBSERVER`], and the distance to the next one, nm.
const FIRST: f64 = 360.0;
const SPACING: f64 = 10.0;
/// The color matching functions x, y and z of CIE 1931 and of CIE 1964, D65 and D50. The last three functions are 0 below 380
/// nm, and constant above 780 nm, where they hardly matter.
#[rustfmt::skip]
const OBSERVER: [[f64; 8]; 48] = [
    [0.0001, 0.0000, 0.0006, 0.0000, 0.0000, 0.0000, 46.64, 24.49],
    [0.0004, 0.0000, 0.0019, 0.0000, 0.0000, 0.0000, 52.09, 24.49],
    [0.0014, 0.0000, 0.0065, 0.0002, 0.0000, 0.0007, 49.98, 24.49],
    [0.0042, 0.0001, 0.0201, 0.0024, 0.0003, 0.0105, 54.65, 29.87],
    [0.0143, 0.0004, 0.0679, 0.0191, 0.0020, 0.0860, 82.75, 49.31],
    [0.0435, 0.0012, 0.2074, 0.0847, 0.0088, 0.3894, 91.49, 56.51],
    [0.1344, 0.0040, 0.6456, 0.2045, 0.0214, 0.9725, 93.43, 60.03],
    [0.2839, 0.0116, 1.3856, 0.3147, 0.0387, 1.5535, 86.68, 57.82],
    [0.3483, 0.0230, 1.7471, 0.3837, 0.0621, 1.9673, 104.87, 74.82],
    [0.3362, 0.0380, 1.7721, 0.3707, 0.0895, 1.9948, 117.01, 87.25],
    [0.2908, 0.0600, 1.6692, 0.3023, 0.1282, 1.7454, 117.81, 90.61],
    [0.1954, 0.0910, 1.2876, 0.1956, 0.1852, 1.3176, 114.86, 91.37],
    [0.0956, 0.1390, 0.8130, 0.0805, 0.2536, 0.7721, 115.92, 95.11],
    [0.0320, 0.2080, 0.4652, 0.0162, 0.3391, 0.4153, 108.81, 91.96],
    [0.0049, 0.3230, 0.2720, 0.0038, 0.4608, 0.2185, 109.35, 95.72],
    [0.0093, 0.5030, 0.1582, 0.0375, 0.6067, 0.1120, 107.80, 96.61],
    [0.0633, 0.7100, 0.0782, 0.1177, 0.7618, 0.0607, 104.79, 97.13],
    [0.1655, 0.8620, 0.0422, 0.2365, 0.8752, 0.0305, 107.69, 102.10],
    [0.2904, 0.9540, 0.0203, 0.3768, 0.9620, 0.0137, 104.41, 100.75],
    [0.4334, 0.9950, 0.0087, 0.5298, 0.9918, 0.0040, 104.05, 102.32],
    [0.5945, 0.9950, 0.0039, 0.7052, 0.9973, 0.0000, 100.00, 100.00],
    [0.7621, 0.9520, 0.0021, 0.8787, 0.9556, 0.0000, 96.33, 97.73],
    [0.9163, 0.8700, 0.0017, 1.0142, 0.8689, 0.0000, 95.79, 98.92],
    [1.0263, 0.7570, 0.0011, 1.1185, 0.7774, 0.0000, 88.69, 93.50],
    [1.0622, 0.6310, 0.0008, 1.1240, 0.6583, 0.0000, 90.01, 97.69],
    [1.0026, 0.5030, 0.0003, 1.0305, 0.5280, 0.0000, 89.60, 99.27],
    [0.8544, 0.3810, 0.0002, 0.8563, 0.3981, 0.0000, 87.70, 99.04],
    [0.6424, 0.2650, 0.0000, 0.6475, 0.2835, 0.0000, 83.29, 95.72],
    [0.4479, 0.1750, 0.0000, 0.4316, 0.1798, 0.0000, 83.70, 98.86],
    [0.2835, 0.1070, 0.0000, 0.2683, 0.1076, 0.0000, 80.03, 95.67],
    [0.1649, 0.0610, 0.0000, 0.1526, 0.0603, 0.0000, 80.21, 98.19],
    [0.0874, 0.0320, 0.0000, 0.0813, 0.0318, 0.0000, 82.28, 103.00],
    [0.0468, 0.0170, 0.0000, 0.0409, 0.0159, 0.0000, 78.28, 99.13],
    [0.0227, 0.0082, 0.0000, 0.0199, 0.0077, 0.0000, 69.72, 87.38],
    [0.0114, 0.0041, 0.0000, 0.0096, 0.0037, 0.0000, 71.61, 91.60],
    [0.0058, 0.0021, 0.0000, 0.0046, 0.0018, 0.0000, 74.35, 92.89],
    [0.0029, 0.0010, 0.0000, 0.0022, 0.0008, 0.0000, 61.60, 76.85],
    [0.0014, 0.0005, 0.0000, 0.0010, 0.0004, 0.0000, 69.89, 86.51],
    [0.0007, 0.0002, 0.0000, 0.0005, 0.0002, 0.0000, 75.09, 92.58],
    [0.0003, 0.0001, 0.0000, 0.0003, 0.0001, 0.0000, 63.59, 78.23],
    [0.0002, 0.0001, 0.0000, 0.0001, 0.0000, 0.0000, 46.42, 57.69],
    [0.0001, 0.0000, 0.0000, 0.0001, 0.0000, 0.0000, 66.81, 82.92],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 63.38, 78.27],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 64.30, 78.27],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 59.45, 78.27],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 51.96, 78.27],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 57.44, 78.27],
    [0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 60.31, 78.27],
];
/// The step of integrals over wavelengths, nm.
const STEP: f64 = 1.0;

/// Blue, green and red, nm. 700 nm is red.
const COLORS: [Range<f32>; 3] = [400.0..500.0, 500.0..600.0, 600.0..701.0];
/// The bands that a color needs, for messages.
pub const COLOR_BANDS: &str =
    "bands in blue, green and red (400 to 500, 500 to 600, 600 to 700 nm)";

/// The wavelengths of written spectra, nm.
pub(crate) const WAVELENGTHS: [f32; 15] = [
    360.0, 400.0, 425.0, 450.0, 475.0, 500.0, 525.0, 550.0, 575.0, 600.0, 625.0, 650.0, 675.0,
    700.0, 830.0,
];
/// Three reflectances, 0 to 1, whose colors are pure red, green and blue, and whose sum is 1: the smoothest ones that are
/// linear between [`WAVELENGTHS`].
#[rustfmt::skip]
pub(crate) const PRIMARIES: [[f32; 3]; 15] = [
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

/// Returns true if bands at these wavelengths in nm have a color: at least one is blue, one green and one red.
#[must_use]
pub fn have_color(wavelengths: &[f32]) -> bool {
    let mut colors = COLORS.iter();
    colors.all(|color| wavelengths.iter().any(|nm| color.contains(nm)))
}

/// Returns the sum of the values of a spectrum, times the weights of each channel.
#[must_use]
pub fn weighted_sums(values: impl Iterator<Item = f64> + Clone, weights: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|channel| {
        let terms = values.clone().zip(weights);
        terms.map(|(value, weight)| value * weight[channel]).sum()
    })
}

impl Viewing {
    /// Returns the weights of the values of a spectrum in linear RGB of sRGB's primaries. A gray spectrum is gray. If the
    /// bands [have no color](have_color), each channel is their mean.
    #[must_use]
    pub fn rgb_weights(self, wavelengths: &[f32]) -> Vec<[f64; 3]> {
        self.weights(wavelengths, FROM_XYZ)
    }

    /// Returns the weights of the values of a spectrum in X, Y and Z, each relative to that of a white spectrum.
    #[must_use]
    pub fn xyz_weights(self, wavelengths: &[f32]) -> Vec<[f64; 3]> {
        self.weights(wavelengths, IDENTITY)
    }

    /// Returns the weights of the values of a spectrum in three channels, with a sum of 1 each. `wavelengths` are its nodes in
    /// nm, in ascending order. The spectrum is linear between them and constant outside. `from_xyz` has a row for each channel.
    fn weights(self, wavelengths: &[f32], from_xyz: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
        if !have_color(wavelengths) {
            return vec![[1.0 / wavelengths.len() as f64; 3]; wavelengths.len()];
        }
        let mut weights = vec![[0.0; 3]; wavelengths.len()];
        let last = FIRST + SPACING * (OBSERVER.len() - 1) as f64;
        let steps = ((last - FIRST) / STEP) as usize;
        for step in 0..=steps {
            let wavelength = FIRST + STEP * step as f64;
            let (xyz, light) = self.at(wavelength);
            let nodes = Position::new(wavelength, wavelengths).weights();
            for (channel, value) in product(&from_xyz, xyz).into_iter().enumerate() {
                for (node, share) in nodes {
                    weights[node][channel] += share * light * value;
                }
            }
        }
        for channel in 0..3 {
            let sum: f64 = weights.iter().map(|weight| weight[channel]).sum();
            weights.iter_mut().for_each(|weight| weight[channel] /= sum);
        }
        weights
    }

    /// Returns the color matching functions and the light at a wavelength in nm, interpolated linearly.
    fn at(self, wavelength: f64) -> ([f64; 3], f64) {
        let position = (wavelength - FIRST) / SPACING;
        let low = (position as usize).min(OBSERVER.len() - 2);
        let share = position - low as f64;
        let column = |i: usize| (1.0 - share) * OBSERVER[low][i] + share * OBSERVER[low + 1][i];
        let first = match self.observer {
            Observer::Cie1931 => 0,
            Observer::Cie1964 => 3,
        };
        let light = match self.illuminant {
            Illuminant::D65 => column(6),
            Illuminant::D50 => column(7),
            // CIE 15: Planck's law at 2848 K in today's scale, 1.435e7 nm K.
            Illuminant::A => {
                1.0 / (wavelength / 560.0).powi(5) / ((1.435e7 / 2848.0 / wavelength).exp() - 1.0)
            }
            Illuminant::E => 1.0,
        };
        ([0, 1, 2].map(|i| column(first + i)), light)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primaries_have_pure_colors_and_add_up_to_white() {
        let weights = Viewing::default().rgb_weights(&WAVELENGTHS);
        for primary in 0..3 {
            let values = PRIMARIES.iter().map(|values| f64::from(values[primary]));
            let sums = weighted_sums(values, &weights);
            for channel in 0..3 {
                let error = sums[channel] - IDENTITY[primary][channel];
                assert!(error.abs() < 2e-3, "{primary} {channel}: {error}");
            }
        }
        for values in PRIMARIES {
            assert!((values.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(values.iter().all(|value| (0.0..=1.0).contains(value)));
        }
    }

    /// The chromaticities of the white points (CIE 15, tables T.3 and T.4).
    #[test]
    fn white_points_are_published_ones() {
        use Illuminant::{A, D50, D65, E};
        use Observer::{Cie1931, Cie1964};
        for (illuminant, observer, expected) in [
            (D65, Cie1931, [0.3127, 0.3290]),
            (D65, Cie1964, [0.3138, 0.3310]),
            (D50, Cie1931, [0.3457, 0.3585]),
            (D50, Cie1964, [0.3477, 0.3595]),
            (A, Cie1931, [0.4476, 0.4074]),
            (A, Cie1964, [0.4512, 0.4059]),
            (E, Cie1931, [1.0 / 3.0, 1.0 / 3.0]),
        ] {
            let viewing = Viewing {
                illuminant,
                observer,
            };
            let mut white = [0.0; 3];
            for wavelength in 360..=830 {
                let (xyz, light) = viewing.at(f64::from(wavelength));
                white
                    .iter_mut()
                    .zip(xyz)
                    .for_each(|(sum, xyz)| *sum += light * xyz);
            }
            let sum: f64 = white.iter().sum();
            for (channel, expected) in expected.into_iter().enumerate() {
                let error = white[channel] / sum - expected;
                assert!(error.abs() < 4e-4, "{viewing:?}: {error}");
            }
        }
    }

    /// If a spectrum is linear between the nodes, additional ones do not change its color.
    #[test]
    fn weights_do_not_depend_on_additional_nodes() {
        let coarse = Viewing::default().rgb_weights(&[400.0, 550.0, 700.0]);
        let fine = Viewing::default().rgb_weights(&[400.0, 550.0, 600.0, 700.0]);
        for channel in 0..3 {
            let sum: f64 = fine[2][channel] / 3.0 + fine[3][channel];
            assert!((coarse[2][channel] - sum).abs() < 1e-9);
        }
    }

    #[test]
    fn bands_without_color_have_equal_weights() {
        let visible = [435.8, 546.1, 700.0, 905.0];
        assert!(have_color(&WAVELENGTHS) && have_color(&visible));
        for bands in [&[550.0][..], &[450.0, 550.0, 905.0], &[500.0, 600.0], &[]] {
            let weights = Viewing::default().rgb_weights(bands);
            assert_eq!(weights, vec![[1.0 / bands.len() as f64; 3]; bands.len()]);
        }
    }
}
