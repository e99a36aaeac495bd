//! Detection of outliers: readings that are improbable, conditioned on the other readings.
//!
//! The detector works on the logarithm u = ln((f w + e) / e) of a reading f, as the model Linear does. The weight is
//! w = cos(theta_i) cos(theta_o), and e = 0.001. The distribution of u over many materials, at all samples of the
//! pattern, is known. Conditioned on the other readings, it predicts the mean and the standard deviation of u at one
//! sample. The z-score of the reading is its distance from that mean in standard deviations.
//!
//! The distribution is a mixture of two groups of equal weight, so that a material only has to resemble one of them:
//! - The built-in procedural materials, for every recipe: a kernel density estimate with one normal distribution per
//!   material. A single normal distribution would not suffice, because highlights are not normally distributed. The
//!   centers are shrunk towards their mean so that the mixture keeps the covariance of the materials. If the recipe
//!   states the mean of its training materials, all centers are shifted to that mean.
//! - The recipe's training materials, if the recipe has their principal components: a normal distribution about
//!   their mean, with coefficients of variance 1.
//!
//! A constant variance is added to the diagonal of each covariance, because no material can be predicted more exactly.
//! A wrong reading also distorts the predictions of the others, but has the largest z-score itself. Therefore the
//! reading with the largest z-score is removed and the others are predicted again.
//!
//! A reading of an unusual material is improbable, too, but it helps to predict the others. Only the worst outlier is
//! excluded from the fit, and only if the others predict each other better without it.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::numeric::Rows;
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::{Material, Procedural};
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

/// The largest number of samples to check; the work grows with its cube.
pub const MAX_SAMPLES: usize = 512;
/// The minimum number of readings per outlier. Detection stops at this ratio, because predictions from too few
/// remaining readings are unreliable.
const READINGS_PER_OUTLIER: usize = 4;
/// The gain above which the worst outlier is excluded from the fit. It was chosen with a recipe of 16 readings on 16
/// networks of MERL materials and 17 measurements of RGL.
const MIN_GAIN: f64 = 0.5;
/// The number of procedural materials in the mixture.
const PROCEDURAL_MATERIALS: usize = 500;
/// The seed of these materials.
const PROCEDURAL_SEED: u64 = 11;
/// The bandwidth: the standard deviation about each material relative to that of all materials.
const BANDWIDTH: f64 = 0.7;
/// The smallest standard deviation of u that procedural materials predict. It is larger than [`TRAINED_FLOOR`] because
/// measured materials only resemble them.
const PROCEDURAL_FLOOR: f64 = 0.3;
/// The smallest standard deviation of u that a recipe's training materials predict.
const TRAINED_FLOOR: f64 = 0.2;

/// Returns the z-score above which one of k readings is an outlier: sqrt(1 + 2 ln k). The largest of k standard normal
/// numbers is about sqrt(2 ln k), so the rate of false positives does not increase with k.
///
/// The constant 1 was chosen on networks of MERL materials. A smaller constant reports more correct readings as
/// outliers; a larger one misses more readings that are ten times too large.
#[must_use]
pub fn outlier_threshold(readings: usize) -> f64 {
    (1.0 + 2.0 * (readings.max(1) as f64).ln()).sqrt()
}

/// The prediction of one reading from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The z-score of the reading, positive if the reading is larger than expected: the one of largest magnitude among
    /// the z-scores of the three channels and of their mean.
    pub z: f64,
    /// The expected BRDF in linear RGB, sr^-1, not times the cosine.
    pub expected: [f32; 3],
}

/// A reading that is improbable, conditioned on the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// The index of the sample.
    pub sample: usize,
    /// The prediction from the other readings, after the removal of worse outliers.
    pub prediction: Prediction,
}

/// The result of outlier detection.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlierReport {
    /// The prediction of each sample; None if its reading is missing. For an outlier, it is the prediction just before
    /// its removal. For any other reading, it is the prediction after the removal of all outliers.
    pub predictions: Vec<Option<Prediction>>,
    /// The outliers, worst first.
    pub outliers: Vec<Outlier>,
    /// The sample of the worst outlier, if the other readings predict each other better without it.
    pub excluded: Option<usize>,
    /// The z-score above which a reading is an outlier.
    pub threshold: f64,
}

impl OutlierReport {
    /// Returns a report without predictions, for readings that are not checked.
    pub(super) fn empty(samples: usize) -> Self {
        Self {
            predictions: vec![None; samples],
            outliers: Vec::new(),
            excluded: None,
            threshold: f64::INFINITY,
        }
    }
}

/// The distribution of u = ln((f w + e) / e) at a recipe's pattern over many materials.
pub struct Distribution {
    /// cos(theta_i) cos(theta_o) of each sample.
    weights: Vec<f64>,
    groups: Vec<NormalGroup>,
}

/// Normal distributions of equal weight with one covariance and several means.
struct NormalGroup {
    means: Vec<DVector<f64>>,
    covariance: DMatrix<f64>,
}

/// The marginal distribution of a group at the samples that have a reading.
struct Marginal<'a> {
    group: &'a NormalGroup,
    /// The inverse of the covariance between these samples.
    precision: DMatrix<f64>,
    /// The logarithm of the determinant of that covariance.
    log_determinant: f64,
}

impl Distribution {
    /// Creates the distribution at a recipe's pattern; None if the pattern has more than [`MAX_SAMPLES`] samples.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>) -> Option<Self> {
        if recipe.samples() > MAX_SAMPLES {
            return None;
        }
        let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
        let weights: Vec<f64> = pattern
            .iter()
            .map(|angles| {
                let at = HalfDifference::from_angles(angles_to_f64(angles));
                at.cos_theta_i() * at.cos_theta_o()
            })
            .collect();
        let groups = [
            Some(NormalGroup::procedural(
                &pattern,
                &weights,
                training_mean(recipe),
            )),
            NormalGroup::trained(recipe),
        ];
        Some(Self {
            weights,
            groups: groups.into_iter().flatten().collect(),
        })
    }

    /// Finds outliers among readings. `readings` has the BRDF of each sample in linear RGB, sr^-1, or None for a
    /// missing or skipped reading.
    #[must_use]
    pub fn find_outliers(&self, readings: &[Option<[f32; 3]>]) -> OutlierReport {
        let mut present: Vec<usize> = (0..self.weights.len())
            .filter(|sample| readings.get(*sample).copied().flatten().is_some())
            .collect();
        let reading = |sample: usize| readings.get(sample).copied().flatten().unwrap_or_default();
        let logarithms: Vec<[f64; 3]> = (0..self.weights.len())
            .map(|sample| reading(sample).map(|f| logarithm(f, self.weights[sample])))
            .collect();
        let max_outliers = present.len() / READINGS_PER_OUTLIER;
        let threshold = outlier_threshold(present.len());
        let mut outliers: Vec<Outlier> = Vec::new();
        loop {
            let predictions = self.predict(&present, &logarithms);
            let worst = present
                .iter()
                .copied()
                .zip(&predictions)
                .enumerate()
                .max_by(|(_, (_, a)), (_, (_, b))| a.z.abs().total_cmp(&b.z.abs()))
                .filter(|(_, (_, prediction))| prediction.z.abs() > threshold);
            match worst {
                Some((position, (sample, prediction))) if outliers.len() < max_outliers => {
                    outliers.push(Outlier {
                        sample,
                        prediction: *prediction,
                    });
                    present.remove(position);
                }
                _ => {
                    let mut all_predictions = vec![None; self.weights.len()];
                    for (sample, prediction) in present.into_iter().zip(predictions) {
                        all_predictions[sample] = Some(prediction);
                    }
                    for outlier in &outliers {
                        all_predictions[outlier.sample] = Some(outlier.prediction);
                    }
                    let all: Vec<usize> = (0..self.weights.len())
                        .filter(|sample| all_predictions[*sample].is_some())
                        .collect();
                    let worst = outliers.first().map(|outlier| outlier.sample);
                    let excluded = worst
                        .filter(|worst| self.gain_without(*worst, &all, &logarithms) > MIN_GAIN);
                    return OutlierReport {
                        predictions: all_predictions,
                        outliers,
                        excluded,
                        threshold,
                    };
                }
            }
        }
    }

    /// Returns how much better the other readings predict each other without the reading of `candidate`: the sum over them
    /// of the differences of the logarithm of their conditional density, averaged over the channels.
    fn gain_without(&self, candidate: usize, present: &[usize], logarithms: &[[f64; 3]]) -> f64 {
        let others: Vec<usize> = present
            .iter()
            .copied()
            .filter(|sample| *sample != candidate)
            .collect();
        let sum = |present: &[usize]| -> f64 {
            let marginals = self.marginals(present);
            (0..3)
                .map(|channel| {
                    let values = present.iter().map(|sample| logarithms[*sample][channel]);
                    let observed = DVector::from_iterator(present.len(), values);
                    let densities = conditional_log_densities(&marginals, present, &observed);
                    let each = present.iter().zip(densities);
                    each.filter(|(sample, _)| **sample != candidate)
                        .map(|(_, density)| density)
                        .sum::<f64>()
                })
                .sum::<f64>()
                / 3.0
        };
        sum(&others) - sum(present)
    }

    /// Returns the marginal distributions at the present samples.
    fn marginals(&self, present: &[usize]) -> Vec<Marginal<'_>> {
        // With its floor, each covariance has an inverse.
        let each = self.groups.iter().map(|group| group.marginal(present));
        each.collect::<Option<_>>().unwrap_or_default()
    }

    /// Predicts each of the present samples from the others.
    fn predict(&self, present: &[usize], logarithms: &[[f64; 3]]) -> Vec<Prediction> {
        let marginals = self.marginals(present);
        let observed_values = |value: fn(&[f64; 3]) -> f64| {
            let values = present.iter().map(|sample| value(&logarithms[*sample]));
            DVector::from_iterator(present.len(), values)
        };
        // The logarithms of the three channels, and their mean.
        let observed = [
            observed_values(|[red, ..]| *red),
            observed_values(|[_, green, _]| *green),
            observed_values(|[.., blue]| *blue),
            observed_values(|channels| channels.iter().sum::<f64>() / 3.0),
        ];
        let moments = observed
            .each_ref()
            .map(|observed| conditional_moments(&marginals, present, observed));
        let prediction = |(position, sample): (usize, &usize)| {
            let z_scores = observed.iter().zip(&moments).map(|(observed, moments)| {
                let (mean, deviation) = moments[position];
                (observed[position] - mean) / deviation
            });
            let z = z_scores.max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let weight = self.weights[*sample];
            let expected = [0, 1, 2].map(|channel: usize| {
                let (mean, _) = moments[channel][position];
                unmap(mean, weight) as f32
            });
            Prediction {
                z: z.unwrap_or_default(),
                expected,
            }
        };
        present.iter().enumerate().map(prediction).collect()
    }
}

/// A normal distribution of the mixture at the present samples, given observed values.
struct Component {
    /// The logarithm of the density of all samples.
    log_density: f64,
    /// The logarithm of the density of all samples but one, for each sample.
    log_density_of_others: DVector<f64>,
    /// The mean of each sample conditioned on the others.
    conditional_mean: DVector<f64>,
}

/// Returns all normal distributions of the mixture. Their log densities omit the same constant for each sample.
fn components(
    marginals: &[Marginal<'_>],
    present: &[usize],
    observed: &DVector<f64>,
) -> Vec<Component> {
    let means = marginals.iter().flat_map(|marginal| {
        let means = marginal.group.means.iter();
        means.map(move |mean| (marginal, mean))
    });
    let all = means.map(|(marginal, mean)| {
        let difference = observed - mean.select_rows(present);
        let scaled_difference = &marginal.precision * &difference;
        let log_density = -0.5 * (difference.dot(&scaled_difference) + marginal.log_determinant)
            - (marginal.group.means.len() as f64).ln();
        let diagonal = marginal.precision.diagonal();
        let log_density_of_others =
            scaled_difference.zip_map(&diagonal, |scaled_difference, precision| {
                log_density
                    + 0.5 * (scaled_difference * scaled_difference / precision - precision.ln())
            });
        Component {
            log_density,
            log_density_of_others,
            conditional_mean: observed - scaled_difference.component_div(&diagonal),
        }
    });
    all.collect()
}

/// Returns the logarithm of the density of each present sample conditioned on the others, without a constant.
fn conditional_log_densities(
    marginals: &[Marginal<'_>],
    present: &[usize],
    observed: &DVector<f64>,
) -> Vec<f64> {
    let components = components(marginals, present, observed);
    let log_sum = |values: &dyn Fn(&Component) -> f64| {
        let max = components
            .iter()
            .map(values)
            .fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = components
            .iter()
            .map(|each| (values(each) - max).exp())
            .sum();
        max + sum.ln()
    };
    let joint = log_sum(&|each| each.log_density);
    let positions = 0..present.len();
    positions
        .map(|position| joint - log_sum(&|each| each.log_density_of_others[position]))
        .collect()
}

/// Returns the mean and the standard deviation of each present sample's logarithm, conditioned on the others.
fn conditional_moments(
    marginals: &[Marginal<'_>],
    present: &[usize],
    observed: &DVector<f64>,
) -> Vec<(f64, f64)> {
    let components = components(marginals, present, observed);
    let variances = marginals.iter().flat_map(|marginal| {
        let variances = marginal.precision.diagonal().map(f64::recip);
        std::iter::repeat_n(variances, marginal.group.means.len())
    });
    let variances: Vec<DVector<f64>> = variances.collect();
    (0..present.len())
        .map(|position| {
            let log_densities = components
                .iter()
                .map(|each| each.log_density_of_others[position]);
            let max = log_densities.fold(f64::NEG_INFINITY, f64::max);
            let (mut sum_of_weights, mut sum, mut sum_of_squares) = (0.0, 0.0, 0.0);
            for (each, variance) in components.iter().zip(&variances) {
                let weight = (each.log_density_of_others[position] - max).exp();
                // Relative to the reading, to avoid cancellation.
                let expected = each.conditional_mean[position] - observed[position];
                sum_of_weights += weight;
                sum += weight * expected;
                sum_of_squares += weight * (variance[position] + expected * expected);
            }
            let mean = sum / sum_of_weights;
            let variance = (sum_of_squares / sum_of_weights - mean * mean).max(f64::MIN_POSITIVE);
            (observed[position] + mean, variance.sqrt())
        })
        .collect()
}

impl NormalGroup {
    /// Creates the group of the procedural materials from the mean of u over the channels of each material. `center`
    /// replaces the mean of the materials unless it is None.
    fn procedural(pattern: &[Angles<f32>], weights: &[f64], center: Option<DVector<f64>>) -> Self {
        let set = Procedural::set(PROCEDURAL_MATERIALS, PROCEDURAL_SEED);
        let points: Vec<DVector<f64>> = set
            .par_iter()
            .map(|material| {
                let samples = pattern.iter().zip(weights).map(|(angles, weight)| {
                    let channels = material.brdf(*angles).map(|f| logarithm(f, *weight));
                    channels.iter().sum::<f64>() / 3.0
                });
                DVector::from_iterator(pattern.len(), samples)
            })
            .collect();
        let mean = points.iter().sum::<DVector<f64>>() / points.len() as f64;
        let mut covariance = DMatrix::zeros(pattern.len(), pattern.len());
        for point in &points {
            let difference = point - &mean;
            covariance.ger(1.0 / points.len() as f64, &difference, &difference, 1.0);
        }
        let shrinkage = (1.0 - BANDWIDTH * BANDWIDTH).sqrt();
        let center = center.as_ref().unwrap_or(&mean);
        let means = points
            .iter()
            .map(|point| center + (point - &mean) * shrinkage);
        Self {
            means: means.collect(),
            covariance: with_floor(covariance * (BANDWIDTH * BANDWIDTH), PROCEDURAL_FLOOR),
        }
    }

    /// Creates the group of a recipe's training materials; None if the recipe does not hold their components.
    fn trained(recipe: &Recipe<'_>) -> Option<Self> {
        recipe.estimator().net()?;
        let coefficients = recipe.estimator().coefficients()?;
        let rows = coefficients.rows();
        let loading = |sample, component| f64::from(rows.entry(sample, component));
        let rows = DMatrix::from_fn(recipe.samples(), coefficients.components(), loading);
        Some(Self {
            means: vec![training_mean(recipe)?],
            covariance: with_floor(&rows * rows.transpose(), TRAINED_FLOOR),
        })
    }

    /// Returns the marginal distribution at the present samples; None if its covariance has no inverse.
    fn marginal(&self, present: &[usize]) -> Option<Marginal<'_>> {
        let covariance = self.covariance.select_rows(present).select_columns(present);
        let factors = Cholesky::new(covariance)?;
        Some(Marginal {
            group: self,
            precision: factors.inverse(),
            log_determinant: factors.ln_determinant(),
        })
    }
}

/// Returns the mean logarithms of a recipe's training materials; None if the recipe does not hold them.
fn training_mean(recipe: &Recipe<'_>) -> Option<DVector<f64>> {
    recipe.estimator().net()?;
    let center = recipe.estimator().coefficients()?.ridge.center;
    let center = center.iter().map(f64::from);
    Some(DVector::from_iterator(recipe.samples(), center))
}

/// Adds the square of a standard deviation to the diagonal of a covariance.
fn with_floor(mut covariance: DMatrix<f64>, floor: f64) -> DMatrix<f64> {
    for index in 0..covariance.nrows() {
        covariance[(index, index)] += floor * floor;
    }
    covariance
}

/// Returns u = ln((f w + e) / e) of a BRDF f. A value of f below 0, from noise, counts as 0.
fn logarithm(brdf: f32, weight: f64) -> f64 {
    map(f64::from(brdf).max(0.0), weight.max(0.0))
}
