//! The spectrum of a fit: a BRDF for each band.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use serde::{Deserialize, Serialize};

use crate::basis::Basis;
use crate::{Brdf, BrdfWithDerivative, FittedBrdf, Viewing, weighted_sums};

/// The number of bands of a group.
const GROUP: usize = 3;

/// Wavelengths and values, as in a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BandValues {
    /// Wavelengths in nm, in ascending order.
    pub wavelengths: Vec<f32>,
    /// The values of fits: for Linear, one for each three bands, as red, green and blue; for other models, one for each band,
    /// as red.
    pub values: Vec<Vec<f32>>,
}

/// A spectral BRDF.
#[derive(Clone, Debug)]
pub struct Bands {
    values: BandValues,
    fits: Vec<FittedBrdf>,
    /// The number of bands of a fit.
    per_fit: usize,
    /// The weights of the bands in RGB.
    weights: Vec<[f64; 3]>,
}

/// Three bands of a BRDF, instead of red, green and blue. The last group may repeat the last band.
pub struct BandGroup<'b> {
    bands: &'b Bands,
    first: usize,
}

impl Bands {
    /// Returns the number of bands of a fit of a model. The coefficients of Linear's channels are independent.
    #[must_use]
    pub fn per_fit(model: ModelKind) -> usize {
        match model {
            ModelKind::Linear => GROUP,
            _ => 1,
        }
    }

    /// Makes a spectral BRDF. None if wavelengths do not increase, or values do not match them, the model or the basis.
    #[must_use]
    pub fn new(values: BandValues, model: ModelKind, basis: Option<&Basis>) -> Option<Self> {
        let per_fit = Self::per_fit(model);
        let mut numbers = values.values.iter().flatten();
        let is_valid = values.wavelengths.is_sorted_by(|a, b| a < b)
            && !values.wavelengths.is_empty()
            && values.values.len() == values.wavelengths.len().div_ceil(per_fit)
            && numbers.all(|value| value.is_finite());
        let fits = values.values.iter().filter(|_| is_valid);
        let fits = fits.map(|values| FittedBrdf::new(model, values.clone(), basis));
        let fits = fits.collect::<Option<Vec<_>>>()?;
        is_valid.then(|| Self {
            weights: Viewing::default().rgb_weights(&values.wavelengths),
            values,
            fits,
            per_fit,
        })
    }

    /// Returns the values in a file.
    #[must_use]
    pub fn values(&self) -> &BandValues {
        &self.values
    }

    /// Returns the wavelengths of the bands in nm, in ascending order.
    #[must_use]
    pub fn wavelengths(&self) -> &[f32] {
        &self.values.wavelengths
    }

    /// Returns a BRDF for each three bands.
    pub fn groups(&self) -> impl Iterator<Item = BandGroup<'_>> {
        let firsts = (0..self.wavelengths().len()).step_by(GROUP);
        firsts.map(|first| BandGroup { bands: self, first })
    }

    /// Returns the BRDF of each band, sr^-1, not times the cosine, at each of these directions.
    #[must_use]
    pub fn evaluate(&self, at: &[HalfDifference<f32>]) -> Vec<Vec<f32>> {
        let mut spectra = vec![Vec::new(); at.len()];
        for group in self.groups() {
            for (spectrum, brdf) in spectra.iter_mut().zip(group.values_at(at)) {
                let left = self.wavelengths().len() - spectrum.len();
                spectrum.extend(brdf.into_iter().take(left));
            }
        }
        spectra
    }

    /// Returns the colors of the spectra (CIE 1931, D65) in linear RGB, sr^-1, not times the cosine.
    pub(crate) fn colors_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let spectra = self.evaluate(at);
        spectra
            .iter()
            .map(|spectrum| self.color(spectrum))
            .collect()
    }

    /// Returns the color at angles, and for each channel its derivatives with respect to theta_h, theta_d and phi_d.
    pub(crate) fn brdf_with_derivative(&self, angles: Angles<f32>) -> BrdfWithDerivative {
        let groups = self
            .groups()
            .map(|group| group.brdf_with_derivative(angles));
        let (values, derivatives): (Vec<_>, Vec<_>) = groups.unzip();
        let by_angle = [0, 1, 2].map(|angle| {
            let derivatives = derivatives
                .as_flattened()
                .iter()
                .map(|channel| channel[angle]);
            self.color(&derivatives.collect::<Vec<_>>())
        });
        let derivative = [0, 1, 2].map(|channel| by_angle.map(|color| color[channel]));
        (self.color(values.as_flattened()), derivative)
    }

    fn color(&self, spectrum: &[f32]) -> [f32; 3] {
        let spectrum = spectrum.iter().map(|value| f64::from(*value));
        weighted_sums(spectrum, &self.weights).map(|sum| sum as f32)
    }
}

impl BandGroup<'_> {
    /// Returns the fit of all bands, or one fit for each.
    fn fits(&self) -> &[FittedBrdf] {
        let fits = &self.bands.fits;
        if self.bands.per_fit == GROUP {
            &fits[self.first / GROUP..][..1]
        } else {
            &fits[self.first..fits.len().min(self.first + GROUP)]
        }
    }

    /// Returns the results for the three bands from the results of each fit's channels.
    fn join<T: Copy>(&self, results: &[[T; 3]]) -> [T; 3] {
        if self.bands.per_fit == GROUP {
            return results[0];
        }
        [0, 1, 2].map(|band| results[band.min(results.len() - 1)][0])
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> BrdfWithDerivative {
        let results = self.fits().iter();
        let results = results.map(|fit| fit.brdf_with_derivative(angles));
        let (values, derivatives): (Vec<_>, Vec<_>) = results.unzip();
        (self.join(&values), self.join(&derivatives))
    }
}

impl Brdf for BandGroup<'_> {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let fits = self.fits().iter().map(|fit| fit.values_at(at));
        let fits: Vec<Vec<[f32; 3]>> = fits.collect();
        let of_fits = |index: usize| fits.iter().map(|values| values[index]).collect::<Vec<_>>();
        (0..at.len())
            .map(|index| self.join(&of_fits(index)))
            .collect()
    }
}
