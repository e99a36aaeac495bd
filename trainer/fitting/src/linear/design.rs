//! The part of a posterior that does not depend on the values of readings.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix};

use super::prior::{MaterialPrior, PriorAt, SHARES, VARIANCE};

/// The part of a posterior that does not depend on the values of readings.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) prior: MaterialPrior,
    pub(super) at: PriorAt,
    /// The variances of the readings' noise.
    pub(super) noise: Vec<f64>,
    /// Those of the mean of the channels, and of the differences, which readings without color do not have.
    pub(super) parts: [Part; 2],
}

/// A part of a [`Design`].
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// R^-1, n x n. Rows and columns of removed readings are 0. Without gray readings, both parts share it.
    pub(super) inverse: Arc<DMatrix<f64>>,
    /// R^-1 Q, n x K.
    pub(super) gain: Arc<DMatrix<f64>>,
    /// The covariance of the coefficients: (V^-1 + Q' R^-1 Q / share)^-1, K x K.
    pub(super) covariance: DMatrix<f64>,
}

impl Design {
    /// `inverses` are those of both parts. None if a number is not finite.
    pub(super) fn new(
        (prior, at, noise): (MaterialPrior, PriorAt, Vec<f64>),
        inverses: [Arc<DMatrix<f64>>; 2],
    ) -> Option<Self> {
        let gains = of_parts(&inverses, |inverse| inverse * &at.rows);
        let part = |part: usize| {
            let (inverse, gain) = (inverses[part].clone(), gains[part].clone());
            let mut precision = at.rows.transpose() * &*gain / SHARES[part];
            for (k, variance) in prior.variance[part].iter().enumerate() {
                precision[(k, k)] += 1.0 / variance;
            }
            Some(Part {
                covariance: Cholesky::new(precision)?.inverse(),
                inverse,
                gain,
            })
        };
        Some(Self {
            parts: [part(0)?, part(1)?],
            noise,
            at,
            prior,
        })
    }

    /// Returns the inverses of both parts.
    pub(super) fn inverses(&self) -> [Arc<DMatrix<f64>>; 2] {
        self.parts.each_ref().map(|part| part.inverse.clone())
    }
}

/// Computes something of both parts' matrices, once if they share one.
pub(super) fn of_parts<T>(
    matrices: &[Arc<DMatrix<f64>>; 2],
    compute: impl Fn(&DMatrix<f64>) -> T,
) -> [Arc<T>; 2] {
    let [mean, differences] = matrices;
    let of_mean = Arc::new(compute(mean));
    let of_differences = if Arc::ptr_eq(mean, differences) {
        of_mean.clone()
    } else {
        Arc::new(compute(differences))
    };
    [of_mean, of_differences]
}

/// Returns R^-1 without some readings, whose rows and columns are 0 then.
pub(super) fn without_readings(
    inverse: &DMatrix<f64>,
    group: impl Iterator<Item = usize>,
) -> DMatrix<f64> {
    let mut inverse = inverse.clone();
    for index in group {
        let column = inverse.column(index).into_owned();
        if column[index] > 0.0 {
            inverse.ger(-1.0 / column[index], &column, &column, 1.0);
            inverse.column_mut(index).fill(0.0);
            inverse.row_mut(index).fill(0.0);
        }
    }
    inverse
}

/// Returns the variance of the discrepancy of a channel, given its covariances with the readings: s^2 - k' R^-1 k.
pub(super) fn discrepancy_after(inverse: &DMatrix<f64>, column: &[(usize, f64)]) -> f64 {
    let terms = column.iter().map(|(row, entry)| {
        // The inverse is symmetric: what is above its diagonal counts twice.
        let solved = inverse.column(*row);
        let solved = solved.as_slice();
        let above = column.iter().take_while(|(other, _)| other < row);
        let above: f64 = above.map(|(other, entry)| entry * solved[*other]).sum();
        entry * (2.0 * above + entry * solved[*row])
    });
    VARIANCE - terms.sum::<f64>()
}
