//! The prediction of the loss of a fit from its completed coefficients.

use glimpse_core::fit::Uncertainty;
use glimpse_core::recipe::MAX_PREDICTION;
use nalgebra::{DMatrix, DVector};

/// The ridge penalty of weights, for features normalized to a mean square of 1.
const RIDGE: f64 = 0.01;
/// The share of materials for which the upper bound holds.
const COVERAGE: f64 = 0.9;
/// The share of materials like those of the training whose innovation is not unusual.
const LIKE_TRAINING: f64 = 0.99;

/// The completed coefficients of a material, and the loss of its fit by a recipe trained without it.
#[derive(Clone, Debug)]
pub struct HeldOutLoss {
    /// The mean of each coefficient over channels.
    pub coefficients: Vec<f32>,
    /// The innovation, by a recipe trained without the material.
    pub innovation: f32,
    /// The mean residual at the readings, by that recipe.
    pub residual: f32,
    /// The loss.
    pub loss: f32,
    /// The origin of the material.
    pub origin: HeldOutOrigin,
    /// The index of the fold that contains the material.
    pub fold: usize,
}

/// The origin of a held-out material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldOutOrigin {
    /// A training material.
    Material,
    /// An augmentation of a training material.
    Augmentation,
    /// A procedural material of a class that was left out.
    Class,
}

impl HeldOutLoss {
    /// Returns the coefficients, and the logarithms of innovation and residual.
    fn features(&self) -> Vec<f32> {
        let innovation = (self.innovation + Uncertainty::MIN_INNOVATION).ln();
        let residual = (self.residual + Uncertainty::MIN_RESIDUAL).ln();
        let mut features = self.coefficients.clone();
        features.extend([innovation, residual]);
        features
    }
}

/// A log-linear predictor of the loss: the exponential of a bias plus weighted coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct LossPredictor {
    /// The bias, and one weight per coefficient.
    pub weights: Vec<f32>,
    /// Spearman's rank correlation of predicted and actual losses on plain materials. The losses of a fold are
    /// predicted by a regression on the other folds. None for fewer than two plain materials.
    pub rank_correlation: Option<f64>,
    /// The evidence of the readings.
    pub uncertainty: Uncertainty,
}

impl LossPredictor {
    /// Fits the predictor by ridge regression on the logarithms of losses. The bias includes a correction, which makes
    /// the mean cross-validated prediction for plain materials equal to their mean loss.
    ///
    /// Returns None without data, or if a weight exceeds the range of recipes.
    #[must_use]
    pub fn new(held_out: &[HeldOutLoss], folds: usize) -> Option<Self> {
        let mut weights = regression(held_out.iter())?;
        let pairs = cross_validate(held_out, folds)?;
        let (predicted, actual): (Vec<f64>, Vec<f64>) = pairs
            .iter()
            .filter(|(origin, _)| *origin == HeldOutOrigin::Material)
            .map(|(_, pair)| *pair)
            .unzip();
        let ratio = actual.iter().sum::<f64>() / predicted.iter().sum::<f64>();
        weights[0] += ratio.ln() as f32;
        let is_in_range = |weight: &f32| weight.abs() <= MAX_PREDICTION;
        let bound = [HeldOutOrigin::Material, HeldOutOrigin::Class]
            .into_iter()
            .filter_map(|origin| {
                let of_origin = pairs.iter().filter(|(each, _)| *each == origin);
                let ratios = of_origin.map(|(_, (predicted, actual))| actual / (ratio * predicted));
                quantile(ratios.collect(), COVERAGE)
            })
            .fold(1.0, f64::max);
        let like_training = held_out
            .iter()
            .filter(|each| each.origin != HeldOutOrigin::Class);
        let innovations = like_training.map(|each| f64::from(each.innovation));
        let max_innovation = quantile(innovations.collect(), LIKE_TRAINING)?;
        let residual = weights.pop()?;
        let innovation = weights.pop()?;
        weights.iter().all(is_in_range).then(|| Self {
            rank_correlation: rank_correlation(&predicted, &actual),
            weights,
            uncertainty: Uncertainty {
                innovation,
                residual,
                bound: bound as f32,
                max_innovation: (max_innovation as f32).max(f32::MIN_POSITIVE),
            },
        })
    }

    /// Returns the predicted loss of a held-out material.
    #[must_use]
    pub fn loss(&self, held_out: &HeldOutLoss) -> f64 {
        let mut weights = self.weights.clone();
        weights.extend([self.uncertainty.innovation, self.uncertainty.residual]);
        predict(&weights, &held_out.features())
    }
}

/// Returns the smallest value that at least `share` of the values do not exceed, with a margin for a finite number of
/// values (split conformal prediction).
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (share * (values.len() + 1) as f64).ceil() as usize;
    values.get(rank.clamp(1, values.len().max(1)) - 1).copied()
}

/// The predicted and the actual loss of a held-out material.
type Pair = (HeldOutOrigin, (f64, f64));

/// Returns the predicted and the actual losses of materials, without augmentations. The losses of a fold are predicted
/// by a regression on the other folds.
fn cross_validate(held_out: &[HeldOutLoss], folds: usize) -> Option<Vec<Pair>> {
    let mut pairs = Vec::new();
    for fold in 0..folds {
        let weights = regression(held_out.iter().filter(|each| each.fold != fold))?;
        let own = held_out
            .iter()
            .filter(|each| each.fold == fold && each.origin != HeldOutOrigin::Augmentation);
        pairs.extend(own.map(|each| {
            let predicted = predict(&weights, &each.features());
            (each.origin, (predicted, f64::from(each.loss)))
        }));
    }
    Some(pairs)
}

/// Returns the loss predicted by weights.
fn predict(weights: &[f32], features: &[f32]) -> f64 {
    let products = weights[1..].iter().zip(features);
    let sum: f64 = products.map(|(w, a)| f64::from(*w) * f64::from(*a)).sum();
    (f64::from(weights[0]) + sum).exp()
}

/// Fits a bias and slopes by ridge regression on the logarithms of losses. The bias makes the mean prediction for plain
/// materials equal to their mean loss.
fn regression<'w>(held_out: impl Iterator<Item = &'w HeldOutLoss>) -> Option<Vec<f32>> {
    let rows: Vec<&HeldOutLoss> = held_out.filter(|each| each.loss > 0.0).collect();
    let lists: Vec<Vec<f32>> = rows.iter().map(|each| each.features()).collect();
    let width = lists.first()?.len();
    let count = rows.len() as f64;
    let mut features = DMatrix::from_fn(rows.len(), width, |i, j| f64::from(lists[i][j]));
    let mut losses = DVector::from_fn(rows.len(), |i, _| f64::from(rows[i].loss).ln());
    losses.add_scalar_mut(-losses.mean());
    let mut scales = Vec::with_capacity(width);
    for mut column in features.column_iter_mut() {
        column.add_scalar_mut(-column.mean());
        let scale = (column.norm_squared() / count).sqrt().max(1e-6);
        column /= scale;
        scales.push(scale);
    }
    let mut normal = features.tr_mul(&features) / count;
    for k in 0..width {
        normal[(k, k)] += RIDGE;
    }
    let normalized_slopes = normal
        .cholesky()?
        .solve(&(features.tr_mul(&losses) / count));
    let slopes = normalized_slopes
        .iter()
        .zip(scales)
        .map(|(slope, scale)| slope / scale);
    let mut weights: Vec<f32> = std::iter::once(0.0)
        .chain(slopes)
        .map(|w| w as f32)
        .collect();
    let plain = || {
        rows.iter()
            .filter(|each| each.origin == HeldOutOrigin::Material)
    };
    let actual: f64 = plain().map(|each| f64::from(each.loss)).sum();
    let uncorrected: f64 = plain()
        .map(|each| predict(&weights, &each.features()))
        .sum();
    weights[0] = (actual / uncorrected).ln() as f32;
    Some(weights)
}

/// Returns Spearman's rank correlation of two lists of equal length; None for fewer than two numbers. Equal numbers are
/// ranked in their order.
#[must_use]
pub fn rank_correlation(one: &[f64], other: &[f64]) -> Option<f64> {
    correlation(&ranks(one), &ranks(other))
}

/// Returns the rank of each number, starting with 0 for the smallest.
fn ranks(numbers: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    let mut ranks = vec![0.0; numbers.len()];
    for (rank, index) in order.into_iter().enumerate() {
        ranks[index] = rank as f64;
    }
    ranks
}

fn correlation(one: &[f64], other: &[f64]) -> Option<f64> {
    let count = one.len() as f64;
    let centered = |list: &[f64]| {
        let mean = list.iter().sum::<f64>() / count;
        DVector::from_iterator(list.len(), list.iter().map(|value| value - mean))
    };
    let (one, other) = (centered(one), centered(other));
    let norms = one.norm() * other.norm();
    (norms > 0.0).then(|| one.dot(&other) / norms)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Held-out losses that depend on their coefficients, and on noise of amplitude `noise`.
    fn held_out(noise: f32) -> Vec<HeldOutLoss> {
        held_out_from(0, noise)
    }

    fn held_out_from(first: usize, noise: f32) -> Vec<HeldOutLoss> {
        let wave = |index: usize, frequency: f32| (frequency * index as f32).sin();
        (first..first + 400)
            .map(|index| {
                let coefficients = vec![wave(index, 0.7), wave(index, 1.3), wave(index, 2.9)];
                let log_loss = 0.8 * coefficients[0] - 0.3 * coefficients[2] - 4.0;
                HeldOutLoss {
                    loss: (log_loss + noise * wave(index, 37.1)).exp(),
                    coefficients,
                    innovation: 0.1,
                    residual: 0.01,
                    origin: match index % 4 {
                        0 => HeldOutOrigin::Material,
                        _ => HeldOutOrigin::Augmentation,
                    },
                    fold: index / 4 % 4,
                }
            })
            .collect()
    }

    #[test]
    fn predicts_loss_determined_by_coefficients() {
        let held_out = held_out(0.0);
        let predictor = LossPredictor::new(&held_out, 4).expect("there are enough materials");
        for each in &held_out {
            let ratio = predictor.loss(each) / f64::from(each.loss);
            assert!((0.97..1.03).contains(&ratio), "{ratio}");
        }
        assert!(predictor.rank_correlation > Some(0.99), "{predictor:?}");
    }

    #[test]
    fn mean_prediction_is_unbiased_with_noise() {
        let held_out = held_out(0.6);
        let predictor = LossPredictor::new(&held_out, 4).expect("there are enough materials");
        let (mut predicted, mut actual) = (0.0, 0.0);
        // Other materials of the same distribution.
        for each in held_out_from(400, 0.6) {
            predicted += predictor.loss(&each);
            actual += f64::from(each.loss);
        }
        assert!(
            (predicted / actual - 1.0).abs() < 0.1,
            "{predicted} and {actual}"
        );
        let rank = predictor.rank_correlation.expect("four folds");
        assert!((0.6..0.95).contains(&rank), "{rank}");
    }

    #[test]
    fn rejects_missing_data_and_excessive_weights() {
        let mut tiny_features = held_out(0.0);
        for each in &mut tiny_features {
            each.coefficients[0] *= 1e-6;
        }
        assert_eq!(
            LossPredictor::new(&tiny_features, 4),
            None,
            "weights exceed the range of recipes"
        );
        assert_eq!(LossPredictor::new(&[], 4), None);
        assert_eq!(ranks(&[3.0, 1.0, 2.0]), [2.0, 0.0, 1.0]);
    }
}
