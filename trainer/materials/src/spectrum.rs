//! Colors of spectra, by the CIE's standard observers and illuminants.

use std::ops::{Range, RangeInclusive};
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::color::{FROM_XYZ, IDENTITY, TO_XYZ, product};
use crate::interpolation::Position;
use crate::lab::Lab;
use crate::rows::rows;

/// A standard illuminant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
pub enum Observer {
    /// CIE 1931, for fields of 2 degrees.
    #[default]
    #[value(name = "2")]
    #[serde(rename = "2")]
    Cie1931,
    /// CIE 1964, for fields of 10 degrees.
    #[value(name = "10")]
    #[serde(rename = "10")]
    Cie1964,
}

/// The conditions of a color.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Viewing {
    /// The light.
    pub illuminant: Illuminant,
    /// The eye.
    pub observer: Observer,
}

/// The first wavelength of [`OBSERVERS`], and the distance to the next one, nm.
const FIRST: f64 = 360.0;
const SPACING: f64 = 10.0;
/// The color matching functions x, y and z of CIE 1931 and of CIE 1964, D65 and D50.
static OBSERVERS: LazyLock<Vec<[f64; 8]>> =
    LazyLock::new(|| rows(include_str!("spectrum/observers.csv")));
/// The wavelengths of integrals, nm.
const WAVELENGTHS: RangeInclusive<u16> = 360..=830;

/// Blue, green and red, nm. 700 nm is red.
const COLORS: [Range<f32>; 3] = [400.0..500.0, 500.0..600.0, 600.0..701.0];
/// The bands that a color needs, for messages.
pub const COLOR_BANDS: &str =
    "bands in blue, green and red (400 to 500, 500 to 600, 600 to 700 nm)";

/// The matrix of Bradford from X, Y and Z to responses of cones, which adapt to white, and its inverse.
const BRADFORD: [[f64; 3]; 3] = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];
const FROM_BRADFORD: [[f64; 3]; 3] = [
    [0.986_993, -0.147_054, 0.159_963],
    [0.432_305, 0.518_360, 0.049_291],
    [-0.008_529, 0.040_043, 0.968_487],
];

/// The wavelengths of written spectra in nm, and the values there of three reflectances, 0 to 1, whose colors are pure red,
/// green and blue, and whose sum is 1.
pub(crate) static PRIMARIES: LazyLock<(Vec<f32>, Vec<[f32; 3]>)> = LazyLock::new(|| {
    let rows: Vec<(f32, [f32; 3])> = rows(include_str!("spectrum/primaries.csv"));
    rows.into_iter().unzip()
});

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

    /// Returns a color in linear RGB, 0 to 1, or below 0 if it is more saturated than the primaries, adapted to D65 by Bradford's
    /// matrix. A gray color stays gray.
    pub fn rgb_of_lab(self, lab: Lab) -> [f64; 3] {
        let white = self.white();
        let [from, to] = [white, product(&TO_XYZ, [1.0; 3])].map(|xyz| product(&BRADFORD, xyz));
        let relative = lab.to_relative_xyz();
        let seen = product(&BRADFORD, [0, 1, 2].map(|i| relative[i] * white[i]));
        let adapted = [0, 1, 2].map(|i| seen[i] * to[i] / from[i]);
        product(&FROM_XYZ, product(&FROM_BRADFORD, adapted))
    }

    /// Returns X, Y and Z of the light, with Y = 1.
    fn white(self) -> [f64; 3] {
        let colors = WAVELENGTHS.map(|nm| self.at(f64::from(nm)));
        let white = colors.fold([0.0; 3], |sum, (xyz, light)| {
            [0, 1, 2].map(|i: usize| sum[i] + light * xyz[i])
        });
        white.map(|sum| sum / white[1])
    }

    /// Returns the weights of the values of a spectrum in three channels, with a sum of 1 each. `wavelengths` are its nodes in
    /// nm, in ascending order. The spectrum is linear between them and constant outside. `from_xyz` has a row for each channel.
    fn weights(self, wavelengths: &[f32], from_xyz: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
        if !have_color(wavelengths) {
            return vec![[1.0 / wavelengths.len() as f64; 3]; wavelengths.len()];
        }
        let mut weights = vec![[0.0; 3]; wavelengths.len()];
        for wavelength in WAVELENGTHS.map(f64::from) {
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
        let low = (position as usize).min(OBSERVERS.len() - 2);
        let share = position - low as f64;
        let column = |i: usize| (1.0 - share) * OBSERVERS[low][i] + share * OBSERVERS[low + 1][i];
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
        let (wavelengths, primaries) = &*PRIMARIES;
        let weights = Viewing::default().rgb_weights(wavelengths);
        for primary in 0..3 {
            let values = primaries.iter().map(|values| f64::from(values[primary]));
            let sums = weighted_sums(values, &weights);
            for channel in 0..3 {
                let error = sums[channel] - IDENTITY[primary][channel];
                assert!(error.abs() < 2e-3, "{primary} {channel}: {error}");
            }
        }
        for values in primaries {
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
            let white = viewing.white();
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
        assert!(have_color(&PRIMARIES.0) && have_color(&visible));
        for bands in [&[550.0][..], &[450.0, 550.0, 905.0], &[500.0, 600.0], &[]] {
            let weights = Viewing::default().rgb_weights(bands);
            assert_eq!(weights, vec![[1.0 / bands.len() as f64; 3]; bands.len()]);
        }
    }
}
