//! The BRDF of a fit: of red, green and blue, or of each band of a spectrum.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, NeuralParameters, ParameterSet};
use glimpse_kernels::ModelKernels;
use serde::{Deserialize, Serialize};

use crate::basis::{BasisTable, Kernels, Reconstruction};
use crate::{Brdf, BrdfWithDerivative, Viewing, angles_of, weighted_sums};

/// The BRDF of a fit: a model and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedBrdf {
    model: ModelKind,
    values: Vec<f32>,
    /// The tabulated BRDF of the model Linear, or None for other models.
    reconstruction: Option<Reconstruction>,
    /// The kernels of the basis.
    kernels: Kernels,
}

impl FittedBrdf {
    /// Makes a BRDF from a model's parameters, or from the [coefficients](BasisTable::coefficients) of Linear (those of red,
    /// of green, of blue) and a basis. Returns None if the number of values is wrong, or if the model is Linear and `basis` is None.
    #[must_use]
    pub fn new(model: ModelKind, values: Vec<f32>, basis: Option<&BasisTable>) -> Option<Self> {
        let reconstruction = match model.parameters() {
            Some(count) if count == values.len() => None,
            Some(_) => return None,
            None => Some(basis?.reconstruct(&values)?),
        };
        Some(Self {
            model,
            values,
            reconstruction,
            kernels: basis.map_or_else(Kernels::default, |basis| basis.kernels().clone()),
        })
    }

    /// Returns the kernels whose coefficients are among the [values](Self::values), after those of the components in each
    /// channel. There are none but for the model Linear, fitted to readings at any directions.
    #[must_use]
    pub fn kernels(&self) -> &Kernels {
        &self.kernels
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// Returns the model's parameters, or Linear's coefficients.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the weights of the model Neural, or None for other models.
    #[must_use]
    pub fn network(&self) -> Option<NeuralParameters<f32>> {
        (self.model == ModelKind::Neural)
            .then(|| NeuralParameters::view(&self.values).copied())
            .flatten()
    }

    /// Returns the BRDF at angles in radians, and for each channel its derivatives with respect to theta_h, theta_d and
    /// phi_d.
    #[must_use]
    pub fn brdf_with_derivative(&self, angles: Angles<f32>) -> BrdfWithDerivative {
        if let Some(reconstruction) = &self.reconstruction {
            let brdf = reconstruction.at_angles(angles);
            let duals = reconstruction.brdf_with_derivative(&angles);
            let derivative = duals.map(|dual| dual.tangent.map(|value| value as f32));
            return (brdf, derivative);
        }
        // Linear, which has no kernels, has a reconstruction.
        let none = ([f32::NAN; 3], [[f32::NAN; 3]; 3]);
        let kernels = ModelKernels::of(self.model);
        kernels.map_or(none, |kernels| {
            (kernels.brdf_with_derivative)(&self.values, angles)
        })
    }
}

impl Brdf for FittedBrdf {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        if let Some(reconstruction) = &self.reconstruction {
            return reconstruction.values_at(at);
        }
        let mut values = vec![[f32::NAN; 3]; at.len()];
        if let Some(kernels) = ModelKernels::of(self.model) {
            (kernels.evaluate)(&self.values, at, &mut values);
        }
        values
    }
}

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
    /// One fit of three bands, or up to three fits of one band.
    fits: &'b [FittedBrdf],
    per_fit: usize,
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
    pub fn new(values: BandValues, model: ModelKind, basis: Option<&BasisTable>) -> Option<Self> {
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
        let per_fit = self.per_fit;
        let groups = self.fits.chunks(GROUP / per_fit);
        groups.map(move |fits| BandGroup { fits, per_fit })
    }

    /// Returns the BRDF of each band, sr^-1, not times the cosine, at each of these directions.
    #[must_use]
    pub fn evaluate(&self, at: &[HalfDifference<f32>]) -> Vec<Vec<f32>> {
        let mut spectra = evaluate(&self.fits, self.per_fit, at);
        for spectrum in &mut spectra {
            spectrum.truncate(self.wavelengths().len());
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
        let fits = self.fits.iter();
        let fits = fits.flat_map(|fit| {
            let (values, derivatives) = fit.brdf_with_derivative(angles);
            values.into_iter().zip(derivatives).take(self.per_fit)
        });
        let (values, derivatives): (Vec<_>, Vec<_>) = fits.unzip();
        let by_angle = [0, 1, 2].map(|angle| {
            let derivatives = derivatives.iter().map(|band| band[angle]);
            self.color(&derivatives.collect::<Vec<_>>())
        });
        let derivative = [0, 1, 2].map(|channel| by_angle.map(|color| color[channel]));
        (self.color(&values), derivative)
    }

    fn color(&self, spectrum: &[f32]) -> [f32; 3] {
        let spectrum = spectrum.iter().map(|value| f64::from(*value));
        weighted_sums(spectrum, &self.weights).map(|sum| sum as f32)
    }
}

impl Brdf for BandGroup<'_> {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let group = |bands: Vec<f32>| [0, 1, 2].map(|band| bands[band.min(bands.len() - 1)]);
        let bands = evaluate(self.fits, self.per_fit, at).into_iter();
        bands.map(group).collect()
    }
}

/// Returns the bands of fits at each of these directions: the first `per_fit` channels of each fit.
fn evaluate(fits: &[FittedBrdf], per_fit: usize, at: &[HalfDifference<f32>]) -> Vec<Vec<f32>> {
    let linear = fits.iter().map(|fit| fit.reconstruction.as_ref());
    if let Some(linear) = linear.collect::<Option<Vec<_>>>() {
        let spectra = at.iter().map(|at| {
            let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
            Reconstruction::brdf_of_all(&linear, &angles_of(at), weight).concat()
        });
        return spectra.collect();
    }
    let mut spectra = vec![Vec::new(); at.len()];
    for fit in fits {
        for (spectrum, brdf) in spectra.iter_mut().zip(fit.values_at(at)) {
            spectrum.extend_from_slice(&brdf[..per_fit]);
        }
    }
    spectra
}
