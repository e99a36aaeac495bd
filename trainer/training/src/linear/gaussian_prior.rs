//! The Gaussian prior of a material's coefficients, for readings at any directions.
//!
//! The coefficients of the three channels are split into their mean and the differences from it. Each part has a
//! covariance over the tasks of a training. The components are chosen so that both covariances are diagonal, so that a fit
//! is core's [ridge](glimpse_core::fit::ridge) solve with two lists of precisions.

use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use super::columns::{Columns, coefficients_of_columns};

const CHANNELS: usize = 3;
/// The variance of a coefficient that both covariances add to their diagonals, as a share of the mean variance.
const MIN_VARIANCE: f64 = 1e-4;

/// Components at all directions, and the variances of their coefficients.
pub struct GaussianPrior {
    /// The components, K.
    pub basis: BasisTable,
    /// The variance of the mean of the channels, K. The mean itself is 0.
    pub mean_variance: Vec<f64>,
    /// The variance of a channel's difference from that mean, K.
    pub difference_variance: Vec<f64>,
}

impl GaussianPrior {
    /// Computes at most `components` components of tasks. None if the tasks are too few to have variances.
    #[must_use]
    pub fn new(tasks: &[Box<dyn Material>], components: usize) -> Option<Self> {
        let columns = Columns::new(tasks);
        let all: Vec<usize> = (0..columns.count()).collect();
        let (basis, rows) = coefficients_of_columns(&columns, &all, components);
        let components = basis.components();
        let count = columns.count() / CHANNELS;
        let rows = DMatrix::from_row_slice(columns.count(), components, &rows).cast::<f64>();
        let means = DMatrix::from_fn(count, components, |task, k| {
            (0..CHANNELS)
                .map(|channel| rows[(CHANNELS * task + channel, k)])
                .sum::<f64>()
                / CHANNELS as f64
        });
        let differences = DMatrix::from_fn(columns.count(), components, |row, k| {
            rows[(row, k)] - means[(row / CHANNELS, k)]
        });
        // The differences of three channels have two degrees of freedom.
        let mean = covariance(&means, count);
        let difference = covariance(&differences, 2 * count);
        let (map, mean_share) = diagonalize(&mean, &difference)?;
        Some(Self {
            basis: basis.mapped(map.cast::<f32>().as_slice()),
            difference_variance: mean_share.iter().map(|share| 1.0 - share).collect(),
            mean_variance: mean_share,
        })
    }
}

/// Returns the mean product of each pair of columns, with a larger diagonal, so that it has an inverse.
fn covariance(rows: &DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let mut covariance = rows.tr_mul(rows) / count as f64;
    let floor = MIN_VARIANCE * covariance.trace() / rows.ncols() as f64;
    for k in 0..rows.ncols() {
        covariance[(k, k)] += floor;
    }
    covariance
}

/// Returns a matrix M with M D M' = `one` and M (1 - D) M' = `other` for a diagonal D, and the diagonal of D, in
/// descending order.
fn diagonalize(one: &DMatrix<f64>, other: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let root = Cholesky::new(one + other)?.l();
    let half = root.solve_lower_triangular(one)?;
    let whitened = root.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new(whitened);
    let mut order: Vec<usize> = (0..one.nrows()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let vectors = eigen.eigenvectors.select_columns(&order);
    let shares = order.iter().map(|k| eigen.eigenvalues[*k]).collect();
    Some((root * vectors, shares))
}
