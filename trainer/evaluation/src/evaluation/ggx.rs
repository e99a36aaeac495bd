//! The fit of today's practice for readings at any directions: a diffuse and a GGX lobe with eight parameters, by robust
//! least squares from four starts (Walter et al. 2007; separable Smith shadowing, Schlick's Fresnel term).

use std::f64::consts::PI;

use glimpse_core::geometry::HalfDifference;
use glimpse_fitting::linear::PosteriorReading;
use glimpse_materials::{Brdf, LUMINANCE};

use crate::least_squares::Errors;
use crate::shading::{Cosines, schlick, separable_lobe};

const PARAMETERS: usize = 8;
/// The bounds of each parameter: logarithms of the diffuse and of the specular color, the logarithm of the roughness, and
/// the logit of the reflectance at normal incidence.
const BOUNDS: [[f64; 2]; PARAMETERS] = [
    [-9.0, 1.5],
    [-9.0, 1.5],
    [-9.0, 1.5],
    [-9.0, 3.0],
    [-9.0, 3.0],
    [-9.0, 3.0],
    [-4.6, 0.3],
    [-6.0, 6.0],
];
/// The roughness of each start.
const ROUGHNESS: [f64; 4] = [0.03, 0.1, 0.3, 0.7];
/// The error from which on errors count absolutely instead of squared.
const ROBUST_SCALE: f64 = 0.05;

/// A fitted diffuse and GGX lobe.
#[derive(Clone, Copy, Debug)]
pub struct Ggx([f64; PARAMETERS]);

/// A reading: its directions with their shares, cos(theta_i), and its value.
struct Target {
    directions: Vec<(Cosines, f64)>,
    cosine: f64,
    rgb: [f64; 3],
    is_gray: bool,
}

impl Target {
    fn new(reading: &PosteriorReading) -> Self {
        let aperture = reading.aperture.as_deref();
        let exact = [(reading.angles, 1.0)];
        let directions = aperture.map_or(&exact[..], |aperture| &aperture.directions);
        let directions = directions.iter().map(|(angles, share)| {
            let at = HalfDifference::from_angles(*angles);
            (Cosines::of(&at), *share)
        });
        Self {
            directions: directions.collect(),
            cosine: f64::from(HalfDifference::from_angles(reading.angles).cos_theta_i()).max(1e-2),
            rgb: reading.brdf.map(|y| f64::from(y.max(0.0))),
            is_gray: aperture.is_some_and(|aperture| aperture.is_gray),
        }
    }

    /// Writes the square roots of the robust errors of the loss.
    fn write_errors(&self, ggx: Ggx, errors: &mut [f64]) {
        let mut modeled = [0.0; 3];
        for (at, share) in &self.directions {
            for (sum, value) in modeled.iter_mut().zip(ggx.brdf(at)) {
                *sum += share * value;
            }
        }
        if self.is_gray {
            modeled = [modeled.iter().zip(LUMINANCE).map(|(f, y)| f * y).sum(); 3];
        }
        let pairs = modeled.into_iter().zip(self.rgb);
        for (root, (modeled, read)) in errors.iter_mut().zip(pairs) {
            let error = (modeled * self.cosine).ln_1p() - (read * self.cosine).ln_1p();
            let hypotenuse = (1.0 + (error / ROBUST_SCALE).powi(2)).sqrt();
            *root = ROBUST_SCALE * (2.0 * (hypotenuse - 1.0)).sqrt() * error.signum();
        }
    }
}

impl Ggx {
    /// Fits readings. Their noise does not matter.
    #[must_use]
    pub fn fit(readings: &[PosteriorReading]) -> Self {
        let targets: Vec<Target> = readings.iter().map(Target::new).collect();
        let diffuse = [0, 1, 2].map(|channel| {
            let mut values: Vec<f64> = targets.iter().map(|one| one.rgb[channel]).collect();
            values.sort_by(f64::total_cmp);
            let median = values.get(values.len() / 2).copied().unwrap_or_default();
            (0.7 * PI * median).max(1e-3).ln()
        });
        let errors = Errors {
            count: 3 * targets.len(),
            write: &|values, errors| {
                let ggx = Self(std::array::from_fn(|index| values[index]));
                for (errors, target) in errors.chunks_exact_mut(3).zip(&targets) {
                    target.write_errors(ggx, errors);
                }
            },
            bounds: &BOUNDS,
            patience: 20,
        };
        let fits = ROUGHNESS.map(|roughness| {
            let [red, green, blue] = diffuse;
            errors.minimize(&[red, green, blue, -2.0, -2.0, -2.0, roughness.ln(), -1.0])
        });
        let best = fits
            .into_iter()
            .min_by(|(one, _), (other, _)| one.total_cmp(other));
        let parameters = best.and_then(|(_, parameters)| parameters.try_into().ok());
        Self(parameters.unwrap_or_default())
    }

    fn brdf(&self, at: &Cosines) -> [f64; 3] {
        let [diffuse @ .., s0, s1, s2, roughness, reflectance] = self.0;
        let normal = 1.0 / (1.0 + (-reflectance).exp());
        let fresnel = schlick(normal, 1.0, at.difference);
        let lobe = fresnel * separable_lobe(roughness.exp(), at);
        let specular = [s0, s1, s2];
        std::array::from_fn(|channel| diffuse[channel].exp() / PI + specular[channel].exp() * lobe)
    }
}

impl Brdf for Ggx {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let values = at.iter().map(|at| self.brdf(&Cosines::of(at)));
        values.map(|rgb| rgb.map(|value| value as f32)).collect()
    }
}
