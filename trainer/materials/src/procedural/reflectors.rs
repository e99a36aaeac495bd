//! The parts of a highlight: microfacet lobes, and a thin film on the reflectors.

use std::f64::consts::PI;

use glimpse_core::numeric::Trigonometry;

/// A microfacet lobe.
#[derive(Clone, Debug)]
pub(super) struct Lobe {
    /// Strength, in linear RGB.
    pub(super) color: [f64; 3],
    /// Reflectance at normal incidence, and the fraction of Schlick's increase from it to 1 at grazing angles.
    pub(super) fresnel: [f64; 2],
    pub(super) roughness: f64,
    /// The exponent gamma of the GTR distribution. 2 is GGX, and larger exponents have shorter tails.
    pub(super) falloff: f64,
    /// The factor that makes the distribution integrate to the lobe's share of the highlight.
    pub(super) scale: f64,
}

/// A thin transparent film: light that its two faces reflect interferes, so its color travels with theta_d.
///
/// The reflectance at wavelength L is proportional to 1 - v cos(2 pi p cos(t) / L), where p is the optical path at
/// normal incidence and t is the angle in the film.
#[derive(Clone, Debug)]
pub(super) struct Film {
    /// The phase 2 pi p / L of each channel.
    phase: [f64; 3],
    /// v of each channel. A channel is a band of wavelengths, which weakens the interference of thick films.
    visibility: [f64; 3],
    /// The film's index of refraction.
    index: f64,
}

impl Film {
    /// The mean wavelength of each channel, and its standard deviation, in nanometers.
    const WAVELENGTHS: [f64; 3] = [610.0, 545.0, 460.0];
    const BANDWIDTH: f64 = 25.0;

    /// Makes a film with an optical path in nanometers.
    pub(super) fn new(path: f64, visibility: f64, index: f64) -> Self {
        let phase = Self::WAVELENGTHS.map(|wavelength| 2.0 * PI * path / wavelength);
        Self {
            phase,
            visibility: std::array::from_fn(|channel| {
                let blur = phase[channel] * Self::BANDWIDTH / Self::WAVELENGTHS[channel];
                visibility * (-0.5 * blur * blur).exp()
            }),
            index,
        }
    }

    /// Returns the factor of a channel's reflectance, at a cosine of theta_d.
    pub(super) fn factor<S: Trigonometry>(&self, channel: usize, cos_theta_d: S) -> S {
        let c = S::constant;
        let one = c(1.0);
        // cos(t) = sqrt(1 - sin^2(theta_d) / index^2).
        let squared = one - (one - cos_theta_d * cos_theta_d) * c(self.index.powi(-2));
        let cosine = (squared.ln() * c(0.5)).exp();
        let (_, interference) = (cosine * c(self.phase[channel])).sin_cos();
        one - interference * c(self.visibility[channel])
    }
}
