//! The fit of today's practice for readings at any directions: a diffuse and a GGX lobe with seven parameters, by robust least
//! squares of logarithms from six starts (Walter et al. 2007; separable Smith shadowing, Schlick's Fresnel term).

use std::f64::consts::FRAC_1_PI;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::linear::EPSILON;
use glimpse_materials::Brdf;

use glimpse_fitting::linear::{LUMINANCE, PosteriorReading};

use crate::least_squares::Errors;
use crate::shading::{Cosines, schlick, separable_lobe};

/// The number of parameters: logarithms of the diffuse color, of the reflectance at normal incidence, and of the roughness.
const PARAMETERS: usize = 7;
const BOUNDS: [f64; 2] = [-9.0, 3.0];
/// The mean and the inverse deviation of a weak prior, which keeps what the readings leave open.
const MEANS: [f64; PARAMETERS] = [-2.0, -2.0, -2.0, -3.0, -3.0, -3.0, -1.5];
const WEIGHT: f64 = 0.03;
/// The largest roughness.
const MAX_ROUGHNESS: f64 = 1.3;
/// The roughness of starts, and their diffuse color and reflectance.
const ROUGHNESS: [f64; 3] = [0.05, 0.2, 0.5];
const COLORS: [[f64; 2]; 2] = [[0.3, 0.04], [0.02, 0.5]];
/// The error of a mapped BRDF from which on errors count absolutely instead of squared.
const ROBUST_SCALE: f64 = 0.05;

/// A fitted diffuse and GGX lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx([f64; PARAMETERS]);

/// A reading: its directions with their shares, the cosines of its map, and its value.
struct Target {
    directions: Vec<(Cosines, f64)>,
    cosines: f64,
    brdf: [f64; 3],
    is_gray: bool,
}

impl Target {
    fn new(reading: &PosteriorReading) -> Self {
        let cosines = |angles| Cosines::of(&HalfDifference::from_angles(angles));
        let directions = match &reading.aperture {
            None => vec![(cosines(reading.angles), 1.0)],
            Some(aperture) => {
                let directions = aperture.directions.iter();
                directions
                    .map(|(angles, share)| (cosines(*angles), *share))
                    .collect()
            }
        };
        let shares = directions.iter();
        let shares = shares.map(|(at, share)| share / (at.light * at.sensor));
        Self {
            cosines: 1.0 / shares.sum::<f64>(),
            directions,
            brdf: reading.brdf.map(|f| f64::from(f.max(0.0))),
            is_gray: reading
                .aperture
                .as_ref()
                .is_some_and(|aperture| aperture.is_gray),
        }
    }

    /// Returns the number of errors.
    fn count(&self) -> usize {
        if self.is_gray { 1 } else { 3 }
    }

    /// Returns the differences of the mapped BRDFs, one for each error.
    fn errors(&self, ggx: &Ggx) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for (at, share) in &self.directions {
            for (mean, value) in mean.iter_mut().zip(ggx.brdf(at)) {
                *mean += share * value;
            }
        }
        if self.is_gray {
            mean = [mean.iter().zip(LUMINANCE).map(|(f, y)| f * y).sum(); 3];
        }
        let mapped = |f: f64| (f * self.cosines + EPSILON).ln();
        std::array::from_fn(|channel| mapped(mean[channel]) - mapped(self.brdf[channel]))
    }
}

impl Ggx {
    /// Fits readings.
    pub(super) fn fit(readings: &[PosteriorReading]) -> Self {
        let targets: Vec<Target> = readings.iter().map(Target::new).collect();
        let count: usize = targets.iter().map(Target::count).sum();
        let errors = Errors {
            count: count + PARAMETERS,
            write: &|values, errors| {
                let parameters = std::array::from_fn(|index| values[index]);
                let ggx = Self(parameters);
                let (mut rest, priors) = errors.split_at_mut(count);
                for target in &targets {
                    let (own, others) = rest.split_at_mut(target.count());
                    for (root, error) in own.iter_mut().zip(target.errors(&ggx)) {
                        let error = error / ROBUST_SCALE;
                        *root = (2.0 * (error.hypot(1.0) - 1.0)).sqrt() * error.signum();
                    }
                    rest = others;
                }
                for (prior, (value, mean)) in priors.iter_mut().zip(values.iter().zip(MEANS)) {
                    *prior = WEIGHT * (value - mean);
                }
            },
            bounds: &[BOUNDS; PARAMETERS],
            patience: 100,
        };
        let starts = ROUGHNESS
            .iter()
            .flat_map(|roughness| COLORS.map(|colors| (roughness, colors)));
        let fits = starts.map(|(roughness, colors)| {
            let [diffuse, normal] = colors.map(f64::ln);
            errors.minimize(&[
                diffuse,
                diffuse,
                diffuse,
                normal,
                normal,
                normal,
                roughness.ln(),
            ])
        });
        let best = fits.min_by(|(one, _), (other, _)| one.total_cmp(other));
        let (_, parameters) = best.unwrap_or_default();
        let parameters: [f64; PARAMETERS] = parameters.try_into().unwrap_or_default();
        Self(parameters)
    }

    fn brdf(&self, at: &Cosines) -> [f64; 3] {
        let [diffuse @ .., f0, f1, f2, roughness] = self.0;
        let lobe = separable_lobe(roughness.exp().min(MAX_ROUGHNESS), at);
        let normal = [f0, f1, f2].map(f64::exp);
        std::array::from_fn(|channel| {
            let fresnel = schlick(normal[channel], normal[channel].max(1.0), at.difference);
            FRAC_1_PI * diffuse[channel].exp() + fresnel * lobe
        })
    }
}

impl Brdf for Ggx {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let values = at.iter().map(|at| self.brdf(&Cosines::of(at)));
        values.map(|rgb| rgb.map(|value| value as f32)).collect()
    }
}
