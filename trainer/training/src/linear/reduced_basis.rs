//! A basis reduced to the directions of a pattern.

use glimpse_core::fit::ridge::{Factors, Problem, RidgeError, factor_length, scratch_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::map;
use glimpse_materials::basis::{AngleDual, Basis, Coefficients, median_brdf};

/// The rows of a basis of m components at n directions, with derivatives with respect to the angles.
#[derive(Clone, Debug)]
pub struct ReducedBasis {
    /// The directions, angles in radians.
    pub angles: Vec<Angles<f64>>,
    /// The matrix A: n rows of m values.
    pub basis: Vec<f64>,
    /// The derivatives of each entry of A with respect to the three angles of its row.
    pub derivatives: Vec<[f64; 3]>,
    /// The mean of the training BRDFs after [`map`], n values.
    pub mean: Vec<AngleDual>,
    /// The median of the training BRDFs, sr⁻¹ (not times the cosine), n values.
    pub median: Vec<AngleDual>,
    /// cos(theta_i) cos(theta_o), n values.
    pub weight: Vec<AngleDual>,
}

impl ReducedBasis {
    /// Evaluates the basis at angles in radians, which must be valid.
    #[must_use]
    pub fn new(basis: &Basis, pattern: &[Angles<f64>]) -> Self {
        let mut reduced = Self {
            angles: pattern.to_vec(),
            basis: Vec::with_capacity(pattern.len() * basis.components()),
            derivatives: Vec::with_capacity(pattern.len() * basis.components()),
            mean: Vec::new(),
            median: Vec::new(),
            weight: Vec::new(),
        };
        for angles in pattern {
            let row = basis.look_up(*angles);
            for [value, derivatives @ ..] in row.components {
                reduced.basis.push(value);
                reduced.derivatives.push(derivatives);
            }
            let dual = |[value, tangent @ ..]: [f64; 4]| AngleDual { value, tangent };
            let direction = HalfDifference::from_angles(AngleDual::variables(*angles));
            let weight = direction.cos_theta_i() * direction.cos_theta_o();
            reduced.mean.push(dual(row.mean));
            reduced
                .median
                .push(median_brdf(dual(row.log_median), weight));
            reduced.weight.push(weight);
        }
        reduced
    }

    /// Returns n, the number of directions.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.mean.len()
    }

    /// Returns t: the mapped BRDF of a sample minus the mean.
    #[must_use]
    pub fn mapped(&self, sample: usize, brdf: AngleDual) -> AngleDual {
        map(brdf, self.median[sample], self.weight[sample]) - self.mean[sample]
    }

    /// Factorizes the ridge problem in `buffer`.
    ///
    /// # Errors
    /// Fails if the system has no solution.
    pub fn factorize<'a, 'b>(
        &'a self,
        precision: &'a [f64],
        buffer: &'b mut Vec<f64>,
    ) -> Result<Factors<'a, 'b, f64, f64>, RidgeError> {
        buffer.resize(factor_length(self.samples(), precision.len()), 0.0);
        let mut scratch = vec![0.0; scratch_length(self.samples(), precision.len())];
        Problem::new(&self.basis[..], precision)?.factorize(buffer, &mut scratch)
    }

    /// Returns the coefficients of measured values, one per sample (BRDF in linear RGB, sr⁻¹, not times the cosine).
    ///
    /// # Errors
    /// Fails if the system has no solution.
    pub fn fit(
        &self,
        precision: &[f64],
        measured: &[[f32; 3]],
    ) -> Result<Coefficients, RidgeError> {
        let mut buffer = Vec::new();
        let factors = self.factorize(precision, &mut buffer)?;
        let components = precision.len();
        let mut scratch = vec![0.0; scratch_length(self.samples(), components)];
        let mut coefficients = [(); 3].map(|()| vec![0.0; components]);
        for (channel, coefficients) in coefficients.iter_mut().enumerate() {
            let mapped: Vec<f64> = measured
                .iter()
                .enumerate()
                .map(|(sample, brdf)| {
                    let brdf = AngleDual::from_value(f64::from(brdf[channel]));
                    self.mapped(sample, brdf).value
                })
                .collect();
            factors.coefficients(&mapped, coefficients, &mut scratch)?;
        }
        Ok(coefficients)
    }
}
