//! The evidence of an interpretation of readings: how probable their numbers are for some material of the prior.

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::EPSILON;
use nalgebra::{Cholesky, Dyn};

use super::posterior::{MIN_NOISE, mapped};
use super::prior::{MaterialPrior, PriorAt, SHARES, dense};

/// The degrees of freedom of the t distribution: as many as the readings that the prior's own scale counts as.
const FREEDOM: f64 = 6.0;

/// The prior of readings at some directions.
pub(crate) struct Evidence {
    at: PriorAt,
    /// The factors of the covariances of the mean of the channels, and of their differences from it.
    factors: [Cholesky<f64, Dyn>; 2],
}

impl Evidence {
    /// Evaluates a prior at directions. `noise` is the standard deviation of each reading's noise, relative to the reading.
    /// None if a number is not finite.
    pub(crate) fn new(
        prior: &MaterialPrior,
        angles: Vec<Angles<f32>>,
        noise: &[f32],
    ) -> Option<Self> {
        let at = prior.at(angles);
        let mut rest = dense(noise.len(), &at.discrepancy(&at));
        for (index, noise) in noise.iter().enumerate() {
            rest[(index, index)] += f64::from(noise.max(MIN_NOISE)).powi(2);
        }
        let factor = |part: usize| {
            let mut scaled = at.rows.clone();
            for (mut column, variance) in scaled.column_iter_mut().zip(&prior.variance[part]) {
                column *= *variance;
            }
            Cholesky::new(SHARES[part] * &rest + scaled * at.rows.transpose())
        };
        Some(Self {
            factors: [factor(0)?, factor(1)?],
            at,
        })
    }

    /// Returns the logarithm of the density of BRDFs (linear RGB, sr^-1, not times the cosine) at the directions, without a
    /// constant: a multivariate t of the mapped values. If all are gray, it is that of their means.
    pub(crate) fn log_density(&self, brdf: &[[f32; 3]]) -> f64 {
        let lists = mapped(&self.at, brdf);
        let is_gray = brdf.iter().all(|[r, g, b]| r == g && r == b);
        // The differences of three channels are those of two independent lists.
        let parts = if is_gray { [1.0, 0.0] } else { [1.0, 2.0] };
        let (mut square, mut determinant) = (0.0, 0.0);
        for ((factor, list), count) in self.factors.iter().zip(&lists).zip(parts) {
            square += list.dot(&factor.solve(list));
            let diagonal = factor.l_dirty().diagonal();
            determinant += count * 2.0 * diagonal.iter().map(|entry| entry.ln()).sum::<f64>();
        }
        let dimensions = brdf.len() as f64 * (parts[0] + parts[1]);
        let slope = |(index, brdf): (usize, &[f32; 3])| {
            let weight = f64::from(self.at.cosines[index]);
            let of = brdf
                .iter()
                .map(|f| (weight / (weight * f64::from(f.max(0.0)) + EPSILON)).ln());
            let share = if is_gray { 1.0 / 3.0 } else { 1.0 };
            of.sum::<f64>() * share
        };
        let slopes: f64 = brdf.iter().enumerate().map(slope).sum();
        let t = -0.5 * (determinant + (FREEDOM + dimensions) * (square / FREEDOM).ln_1p());
        t + slopes
    }
}
