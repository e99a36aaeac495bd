//! The fit of today's practice for readings at any directions: a diffuse and a GGX lobe with eight parameters, by robust
//! least squares from four starts (Walter et al. 2007; separable Smith shadowing, Schlick's Fresnel term).

use std::f64::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::Brdf;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn, SVector, U8};

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
/// The step of a difference quotient.
const STEP: f64 = 1e-6;

/// A fitted diffuse and GGX lobe.
#[derive(Clone, Copy, Debug)]
pub struct Ggx([f64; PARAMETERS]);

impl Ggx {
    /// Fits readings (BRDF in linear RGB, sr^-1) at angles in radians.
    #[must_use]
    pub fn fit(angles: &[Angles<f32>], readings: &[[f32; 3]]) -> Self {
        let at = angles.iter().copied().map(HalfDifference::from_angles);
        let at: Vec<HalfDifference<f32>> = at.collect();
        let readings = readings
            .iter()
            .map(|rgb| rgb.map(|y| f64::from(y.max(0.0))));
        let readings: Vec<[f64; 3]> = readings.collect();
        let diffuse = [0, 1, 2].map(|channel| {
            let mut values: Vec<f64> = readings.iter().map(|rgb| rgb[channel]).collect();
            values.sort_by(f64::total_cmp);
            let median = values.get(values.len() / 2).copied().unwrap_or_default();
            (0.7 * PI * median).max(1e-3).ln()
        });
        let fits = ROUGHNESS.map(|roughness| {
            let [red, green, blue] = diffuse;
            let start = [red, green, blue, -2.0, -2.0, -2.0, roughness.ln(), -1.0];
            let mut problem = Problem {
                at: &at,
                readings: &readings,
                free: SVector::zeros(),
            };
            for ((free, value), [min, max]) in problem.free.iter_mut().zip(start).zip(BOUNDS) {
                let share = ((value - min) / (max - min)).clamp(0.01, 0.99);
                *free = (share / (1.0 - share)).ln();
            }
            let (problem, _) = LevenbergMarquardt::new()
                .with_patience(20)
                .minimize(problem);
            let cost = problem.errors(&problem.free).norm_squared();
            (cost, problem.parameters(&problem.free))
        });
        let best = fits
            .into_iter()
            .min_by(|(one, _), (other, _)| one.total_cmp(other));
        Self(best.map_or([0.0; PARAMETERS], |(_, parameters)| parameters))
    }

    fn brdf(&self, at: &HalfDifference<f32>) -> [f64; 3] {
        let [diffuse @ .., s0, s1, s2, roughness, reflectance] = self.0;
        let alpha = roughness.exp();
        let normal = 1.0 / (1.0 + (-reflectance).exp());
        let [cos_h, cos_d] = [at.hz, at.dz].map(f64::from);
        let [cos_i, cos_o] =
            [at.cos_theta_i(), at.cos_theta_o()].map(|cosine| f64::from(cosine).max(1e-3));
        let squared = alpha * alpha;
        let density = squared / (PI * (cos_h * cos_h * (squared - 1.0) + 1.0).powi(2));
        let shadowing = |cosine: f64| {
            2.0 * cosine / (cosine + (squared + (1.0 - squared) * cosine * cosine).sqrt())
        };
        let fresnel = normal + (1.0 - normal) * (1.0 - cos_d).powi(5);
        let lobe = density * shadowing(cos_i) * shadowing(cos_o) * fresnel / (4.0 * cos_i * cos_o);
        let specular = [s0, s1, s2];
        std::array::from_fn(|channel| diffuse[channel].exp() / PI + specular[channel].exp() * lobe)
    }
}

impl Brdf for Ggx {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.brdf(at).map(|value| value as f32);
        }
    }
}

/// Robust least squares of the loss's errors, over logits of the parameters between their bounds.
struct Problem<'r> {
    at: &'r [HalfDifference<f32>],
    readings: &'r [[f64; 3]],
    free: SVector<f64, PARAMETERS>,
}

impl Problem<'_> {
    fn parameters(&self, free: &SVector<f64, PARAMETERS>) -> [f64; PARAMETERS] {
        std::array::from_fn(|index| {
            let [min, max] = BOUNDS[index];
            min + (max - min) / (1.0 + (-free[index]).exp())
        })
    }

    fn errors(&self, free: &SVector<f64, PARAMETERS>) -> DVector<f64> {
        let ggx = Ggx(self.parameters(free));
        let errors = self.at.iter().zip(self.readings).flat_map(|(at, reading)| {
            let cosine = f64::from(at.cos_theta_i()).max(1e-2);
            let modeled = ggx.brdf(at);
            [0, 1, 2].map(|channel| {
                let error =
                    (modeled[channel] * cosine).ln_1p() - (reading[channel] * cosine).ln_1p();
                // The square of this is the robust error.
                let root = (1.0 + (error / ROBUST_SCALE).powi(2)).sqrt();
                ROBUST_SCALE * (2.0 * (root - 1.0)).sqrt() * error.signum()
            })
        });
        DVector::from_vec(errors.collect())
    }
}

impl LeastSquaresProblem<f64, Dyn, U8> for Problem<'_> {
    type ParameterStorage = Owned<f64, U8>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U8>;

    fn set_params(&mut self, free: &SVector<f64, PARAMETERS>) {
        self.free = *free;
    }

    fn params(&self) -> SVector<f64, PARAMETERS> {
        self.free
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.errors(&self.free))
    }

    fn jacobian(&self) -> Option<nalgebra::OMatrix<f64, Dyn, U8>> {
        let columns = (0..PARAMETERS).map(|index| {
            let [low, high] = [-STEP, STEP].map(|step| {
                let mut free = self.free;
                free[index] += step;
                self.errors(&free)
            });
            (high - low) / (2.0 * STEP)
        });
        let columns: Vec<DVector<f64>> = columns.collect();
        let matrix = DMatrix::from_columns(&columns);
        Some(matrix.fixed_columns::<PARAMETERS>(0).into_owned())
    }
}
