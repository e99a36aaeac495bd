//! The Gaussian prior of a material: components with random coefficients, plus a discrepancy, which components do not express.
//!
//! The mapped BRDF at x is q(x)'a + r(x) in each channel. The coefficients a have the variances v, of their mean over the
//! channels and of the differences from it apart. The discrepancies r of the channels are independent, with the covariance
//! s^2 rho(x, x') of a [`correlation`]. This is kriging with a learned trend (universal kriging: Cressie 1993, "Statistics for
//! Spatial Data", chapter 3.4).

use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::{BasisTable, Kernels, Place, correlation};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::ComponentsAt;

/// The variances of the mean of the channels, and of a difference from it, relative to that of independent channels.
pub(super) const SHARES: [f64; 2] = [1.0 / 3.0, 1.0];
/// The share of the differences' variance in a channel: the three differences sum to 0.
pub(super) const DIFFERENCE_SHARE: f64 = 2.0 / 3.0;

/// s^2, the variance of the discrepancy of a channel.
///
/// It and the lengths were chosen by the losses and coverage of 64 networks of MERL, each with the components of three other
/// folds, for readings of seven instruments. Within a factor of two, the mean of these losses changes by 2 %.
pub(super) const VARIANCE: f64 = 0.02;
/// The [lengths](Kernels::lengths) of its correlation, in degrees.
pub(super) const LENGTHS: [f32; 3] = [12.0, 16.0, 16.0];

/// The prior of a recipe without a pattern, or of one that was made of it for some directions.
#[derive(Clone, Debug)]
pub struct MaterialPrior {
    pub(super) basis: Arc<BasisTable>,
    /// The variances of the coefficients of the mean, and of the differences.
    pub(super) variance: [Vec<f64>; 2],
}

/// The components and the kernels' places at some directions.
#[derive(Clone, Debug)]
pub(super) struct PriorAt {
    pub(super) components: ComponentsAt,
    /// The components, a row for each direction.
    pub(super) rows: DMatrix<f64>,
    places: Vec<Place>,
}

/// The entries of each column of a matrix that are not 0, with their rows.
pub(super) type SparseColumns = Vec<Vec<(usize, f64)>>;

/// Returns a matrix of some rows.
pub(super) fn dense(rows: usize, columns: &SparseColumns) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(rows, columns.len());
    for (column, entries) in columns.iter().enumerate() {
        for (row, entry) in entries {
            dense[(*row, column)] = *entry;
        }
    }
    dense
}

impl MaterialPrior {
    /// Takes the prior of a recipe. None for recipes with a learned pattern.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>, basis: Arc<BasisTable>) -> Option<Self> {
        let coefficients = recipe.estimator().coefficients()?;
        let noise = f64::from(coefficients.noise?.variance);
        let ridge = coefficients.ridge;
        let precisions = [
            (ridge.precision, noise * SHARES[0]),
            (ridge.difference_precision, noise * SHARES[1]),
        ];
        let variance = precisions.map(|(precision, noise)| {
            let precision = precision.iter();
            precision.map(|p| noise / f64::from(p)).collect()
        });
        Some(Self { basis, variance })
    }

    /// Evaluates components and places at directions.
    pub(super) fn at(&self, angles: Vec<Angles<f32>>) -> PriorAt {
        let places = angles.iter().map(|angles| {
            let at = HalfDifference::from_angles(*angles);
            Kernels::place(LENGTHS, &at)
        });
        let places = places.collect();
        let components = ComponentsAt::new(&self.basis, angles);
        let shape = (components.count(), components.components);
        PriorAt {
            rows: DMatrix::from_row_slice(shape.0, shape.1, &components.rows).cast(),
            places,
            components,
        }
    }
}

impl PriorAt {
    /// Returns the covariances of the discrepancy of a channel at these directions with that at others: a column for each of
    /// the others.
    pub(super) fn discrepancy(&self, others: &Self) -> SparseColumns {
        let columns = others.places.par_iter().map(|other| {
            let rows = self.places.iter().enumerate();
            let entries =
                rows.filter_map(|(row, place)| Some((row, VARIANCE * correlation(place, other)?)));
            entries.collect()
        });
        columns.collect()
    }
}
