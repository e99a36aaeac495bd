//! The Gaussian prior of a material: components with random coefficients, plus a discrepancy, which components do not express.
//!
//! The mapped BRDF at x is q(x)'a + r(x) in each channel. The coefficients a have the variances v, of their mean over the
//! channels and of the differences from it apart. The discrepancies r of the channels are independent, with the covariance
//! s^2 rho(x, x') of a [`correlation`]. This is kriging with a learned trend (universal kriging: Cressie 1993, "Statistics for
//! Spatial Data", chapter 3.4).

use std::ops::Range;
use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::recipe::Recipe;
use glimpse_materials::LUMINANCE;
use glimpse_materials::basis::{BasisTable, Kernels, Place, correlation};
use glimpse_materials::lists::{add_scaled, dot};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::ComponentsAt;
use super::aperture::Aperture;

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

/// The largest mapped BRDF around which a reading is linearized.
const MAX_MAPPED: f64 = 20.0;

/// The prior of a recipe without a pattern, or of one that was made of it for some directions.
#[derive(Clone, Debug)]
pub struct MaterialPrior {
    pub(super) basis: Arc<BasisTable>,
    /// The variances of the coefficients of the mean, and of the differences.
    pub(super) variance: [Vec<f64>; 2],
}

/// Weighted sums of the mapped BRDF: at single directions, or over the [apertures](Aperture) of readings.
#[derive(Clone, Debug)]
pub(super) struct PriorAt {
    /// The components at all directions.
    pub(super) components: ComponentsAt,
    /// The kernels' places there.
    places: Vec<Place>,
    /// The directions of each sum.
    pub(super) sums: Vec<Range<usize>>,
    /// The weights of all directions in their sums.
    pub(super) weights: Vec<f64>,
    /// The components, a row for each sum.
    pub(super) rows: DMatrix<f64>,
    /// cos(theta_i) cos(theta_o) of each sum, by which its BRDF is mapped.
    pub(super) cosines: Vec<f32>,
    /// The mapped BRDF in red, green and blue of which each sum is the difference.
    pub(super) centers: Vec<[f32; 3]>,
    /// True for a sum that states nothing about the color.
    pub(super) is_gray: Vec<bool>,
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
        let places: Vec<Place> = places.collect();
        let components = ComponentsAt::new(&self.basis, angles);
        let shape = (components.count(), components.components);
        let cosines = components.cosines.iter().map(|cosines| cosines.value);
        let centers = components.mean.iter().map(|mean| [mean.value; 3]);
        PriorAt {
            rows: DMatrix::from_row_slice(shape.0, shape.1, &components.rows).cast(),
            sums: (0..shape.0).map(|index| index..index + 1).collect(),
            weights: vec![1.0; shape.0],
            cosines: cosines.collect(),
            centers: centers.collect(),
            is_gray: vec![false; shape.0],
            places,
            components,
        }
    }
}

impl PriorAt {
    /// Returns the sums to which readings with apertures are linear around a material, given its mapped BRDF minus the mean of
    /// the training at all directions. These are those of each reading in order, one if it has no aperture.
    ///
    /// A reading is the mean of f over shares o. With the cosines c = cos(theta_i) cos(theta_o), the map of this mean by the
    /// cosines 1 / sum (o / c) is the logarithm of the mean of f c + e over the shares o / c. Its derivative by the mapped BRDF is
    /// (o / c) (f c + e), relative to the sum of these. Of the three channels, it is the mean.
    pub(super) fn linearized(
        &self,
        apertures: &[Option<&Aperture>],
        expected: &[[f64; 3]],
    ) -> Self {
        let mut sums = Self {
            rows: DMatrix::zeros(apertures.len(), self.rows.ncols()),
            sums: Vec::new(),
            cosines: Vec::new(),
            centers: Vec::new(),
            is_gray: Vec::new(),
            ..self.clone()
        };
        let mut first = 0;
        for (index, aperture) in apertures.iter().enumerate() {
            let is_gray = aperture.is_some_and(|aperture| aperture.is_gray);
            let count = aperture.map_or(1, |aperture| aperture.directions.len());
            let range = first..first + count;
            let share = |at: usize| {
                let share = aperture.map_or(1.0, |aperture| aperture.directions[at - first].1);
                share / f64::from(self.cosines[at])
            };
            let cosines = 1.0 / range.clone().map(share).sum::<f64>();
            let of_channels = |values: [f64; 3], shares: [f64; 3]| {
                if is_gray {
                    [dot(&values, &shares); 3]
                } else {
                    values
                }
            };
            // f c + e, relative to e.
            let light = range.clone().map(|at| {
                let mapped =
                    |channel: usize| f64::from(self.centers[at][channel]) + expected[at][channel];
                let light = [0, 1, 2].map(|channel| mapped(channel).min(MAX_MAPPED).exp());
                of_channels(light, LUMINANCE).map(|light| cosines * share(at) * light)
            });
            let light: Vec<[f64; 3]> = light.collect();
            let totals = [0, 1, 2]
                .map(|channel: usize| light.iter().map(|light| light[channel]).sum::<f64>());
            let mut center = totals.map(f64::ln);
            for (at, light) in range.clone().zip(&light) {
                let weight = [0, 1, 2].map(|channel: usize| light[channel] / totals[channel]);
                let weight = weight.iter().sum::<f64>() / 3.0;
                sums.weights[at] = weight;
                let mut row = sums.rows.row_mut(index);
                row += self.rows.row(at) * weight;
                let expected = of_channels(expected[at], [1.0 / 3.0; 3]);
                add_scaled(&mut center, -weight, &expected);
            }
            sums.is_gray.push(is_gray);
            sums.cosines.push(cosines as f32);
            sums.centers.push(center.map(|center| center as f32));
            first = range.end;
            sums.sums.push(range);
        }
        sums
    }

    /// Returns the covariances of the discrepancy of a channel in these sums with that in others: a column for each of the
    /// others.
    pub(super) fn discrepancy(&self, others: &Self) -> SparseColumns {
        let columns = others.sums.par_iter().map(|other| {
            let rows = self.sums.iter().enumerate();
            let entries = rows.filter_map(|(row, own)| {
                let pairs = own
                    .clone()
                    .flat_map(|at| other.clone().map(move |to| (at, to)));
                let terms = pairs.filter_map(|(at, to)| {
                    let weight = self.weights[at] * others.weights[to];
                    Some(weight * correlation(&self.places[at], &others.places[to])?)
                });
                // Places that are too far apart have no entry.
                terms
                    .reduce(|sum, term| sum + term)
                    .map(|sum| (row, VARIANCE * sum))
            });
            entries.collect()
        });
        columns.collect()
    }
}
