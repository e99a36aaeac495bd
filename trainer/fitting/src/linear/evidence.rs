//! The evidence of an interpretation of readings: how probable their numbers are for some material of the prior.

use glimpse_core::model::linear::EPSILON;
use nalgebra::{Cholesky, Dyn};

use super::posterior::{MIN_NOISE, Posterior, PosteriorReading, linearized, mapped};
use super::prior::{PriorAt, SHARES, dense};

/// The degrees of freedom of the t distribution: as many as the readings that the prior's own scale counts as.
const FREEDOM: f64 = 6.0;

/// The prior of readings at some directions.
pub(crate) struct Evidence {
    at: PriorAt,
    /// The factors of the covariances of the mean of the channels, and of their differences from it.
    factors: [Cholesky<f64, Dyn>; 2],
}

impl Evidence {
    /// Evaluates the prior of a posterior at readings, whose values do not matter. Those with apertures are linearized around
    /// the expected material. None if a number is not finite.
    pub(crate) fn new(posterior: &Posterior, readings: &[PosteriorReading]) -> Option<Self> {
        let prior = posterior.prior();
        let at = linearized(prior, readings, |points| posterior.expected(points));
        let mut rest = dense(readings.len(), &at.discrepancy(&at));
        for (index, reading) in readings.iter().enumerate() {
            rest[(index, index)] += f64::from(reading.noise.max(MIN_NOISE)).powi(2);
        }
        let factor = |part: usize| {
            let mut scaled = at.rows.clone();
            for (mut column, variance) in scaled.column_iter_mut().zip(&prior.variance[part]) {
                column *= *variance;
            }
            let mut covariance = SHARES[part] * &rest + scaled * at.rows.transpose();
            let gray = at.is_gray.iter().enumerate();
            for (index, _) in gray.filter(|(_, is_gray)| part == 1 && **is_gray) {
                // It has no differences.
                covariance.row_mut(index).fill(0.0);
                covariance.column_mut(index).fill(0.0);
                covariance[(index, index)] = 1.0;
            }
            Cholesky::new(covariance)
        };
        Some(Self {
            factors: [factor(0)?, factor(1)?],
            at,
        })
    }

    /// Returns the logarithm of the density of BRDFs (linear RGB, sr^-1, not times the cosine) of the readings, without a
    /// constant: a multivariate t of the mapped values. If all are gray, it is that of their means. It is a density of numbers of
    /// which the BRDFs are functions, given the logarithms of their derivatives; a gray reading has one number.
    pub(crate) fn log_density(&self, brdf: &[[f32; 3]], derivatives: &[[f64; 3]]) -> f64 {
        let lists = mapped(&self.at, brdf);
        let all_gray = brdf.iter().all(|[r, g, b]| r == g && r == b);
        let is_gray = |index: usize| all_gray || self.at.is_gray[index];
        // The differences of three channels are those of two independent lists.
        let parts = if all_gray { [1.0, 0.0] } else { [1.0, 2.0] };
        let (mut square, mut determinant) = (0.0, 0.0);
        for ((factor, list), count) in self.factors.iter().zip(&lists).zip(parts) {
            square += list.dot(&factor.solve(list));
            let diagonal = factor.l_dirty().diagonal();
            determinant += count * 2.0 * diagonal.iter().map(|entry| entry.ln()).sum::<f64>();
        }
        let channels = |index: usize| if is_gray(index) { 1 } else { 3 };
        let dimensions = (0..brdf.len()).map(channels).sum::<usize>() as f64;
        let slope = |(index, brdf): (usize, &[f32; 3])| {
            let weight = f64::from(self.at.cosines[index]);
            let of = brdf
                .iter()
                .map(|f| (weight / (weight * f64::from(f.max(0.0)) + EPSILON)).ln());
            let derivatives: f64 = derivatives[index][..channels(index)].iter().sum();
            of.sum::<f64>() * channels(index) as f64 / 3.0 + derivatives
        };
        let slopes: f64 = brdf.iter().enumerate().map(slope).sum();
        let t = -0.5 * (determinant + (FREEDOM + dimensions) * (square / FREEDOM).ln_1p());
        t + slopes
    }
}
