//! A basis reduced to the directions of a pattern.

use glimpse_core::fit::ridge::{System, factor_length, scratch_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::map;
use glimpse_core::numeric::Matrix;
use glimpse_materials::basis::{AngleDual, Basis, Coefficients};

/// The rows of a basis of K components at n directions, with derivatives with respect to the angles.
#[derive(Clone, Debug)]
pub struct ReducedBasis {
    /// The directions, angles in radians.
    pub angles: Vec<Angles<f64>>,
    /// The matrix Q: n rows of K values.
    pub basis: Vec<f64>,
    /// The derivatives of each entry of Q with respect to the three angles of its row.
    pub derivatives: Vec<[f64; 3]>,
    /// The mean of the training BRDFs after [`map`], n values.
    pub center: Vec<AngleDual>,
    /// cos(theta_i) cos(theta_o), n values.
    pub weight: Vec<AngleDual>,
    /// The weights of the readings: 1.
    scales: Vec<f64>,
}

impl ReducedBasis {
    /// Evaluates the basis at angles in radians, which must be valid.
    #[must_use]
    pub fn new(basis: &Basis, pattern: &[Angles<f64>]) -> Self {
        let mut reduced = Self {
            angles: pattern.to_vec(),
            basis: Vec::with_capacity(pattern.len() * basis.components()),
            derivatives: Vec::with_capacity(pattern.len() * basis.components()),
            center: Vec::new(),
            weight: Vec::new(),
            scales: vec![1.0; pattern.len()],
        };
        for angles in pattern {
            let row = basis.look_up(*angles);
            let [value, tangent @ ..] = row.center();
            reduced.center.push(AngleDual { value, tangent });
            for [value, derivatives @ ..] in row.components {
                reduced.basis.push(value);
                reduced.derivatives.push(derivatives);
            }
            let direction = HalfDifference::from_angles(AngleDual::variables(*angles));
            let weight = direction.cos_theta_i() * direction.cos_theta_o();
            reduced.weight.push(weight);
        }
        reduced
    }

    /// Returns n, the number of directions.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.center.len()
    }

    /// Returns t: the mapped BRDF of a sample minus the mean.
    #[must_use]
    pub fn mapped(&self, sample: usize, brdf: AngleDual) -> AngleDual {
        map(brdf, self.weight[sample]) - self.center[sample]
    }

    /// Returns the ridge system.
    #[must_use]
    pub fn system<'a>(&'a self, precision: &'a [f64]) -> System<'a, f64, f64, Matrix<'a, f64>> {
        System {
            rows: Matrix(&self.basis, precision.len()),
            scales: &self.scales,
            precision,
        }
    }

    /// Factorizes the ridge system.
    #[must_use]
    pub fn factorize(&self, precision: &[f64]) -> Vec<f64> {
        let system = self.system(precision);
        let mut factors = vec![0.0; factor_length(self.samples(), precision.len())];
        let mut scratch = vec![0.0; precision.len()];
        for row in 0..system.order() {
            system.factorize_row(row, &mut factors, &mut scratch);
        }
        factors
    }

    /// Returns the coefficients of measured values, one per sample (BRDF in linear RGB, sr⁻¹, not times the cosine).
    #[must_use]
    pub fn fit(&self, precision: &[f64], measured: &[[f32; 3]]) -> Coefficients {
        let factors = self.factorize(precision);
        let mut scratch = vec![0.0; scratch_length(self.samples(), precision.len())];
        let mut coefficients = [(); 3].map(|()| vec![0.0; precision.len()]);
        for (channel, coefficients) in coefficients.iter_mut().enumerate() {
            let samples = measured.iter().enumerate();
            let mapped: Vec<f64> = samples
                .map(|(sample, brdf)| {
                    let brdf = AngleDual::from_value(f64::from(brdf[channel]));
                    self.mapped(sample, brdf).value
                })
                .collect();
            let system = self.system(precision);
            system.solve(&factors, &mapped, coefficients, &mut scratch);
        }
        coefficients
    }
}
