//! The error bar of a completion: from its coefficients to the loss that a fit is likely to have.

use glimpse_core::recipe::MAX_PREDICTION;
use nalgebra::{DMatrix, DVector};

/// What holds weights near 0, beside a mean square of 1 that features have.
const RIDGE: f64 = 0.01;

/// What was completed of one material, and the loss of its fit by what was trained without it.
#[derive(Clone, Debug)]
pub struct HeldOutLoss {
    /// The mean over channels of each coefficient.
    pub coefficients: Vec<f32>,
    /// The loss.
    pub loss: f32,
    /// Whether it is a material as it is, and no augmentation of one.
    pub plain: bool,
    /// The fold that left it out.
    pub fold: usize,
}

/// What says which loss is likely: the exponential of a bias and weighted coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct LossPredictor {
    /// The bias, and a weight for each coefficient.
    pub weights: Vec<f32>,
    /// How well slopes that were found like these rank losses of materials that they were not found by:
    /// Spearman's rank correlation, each fold's plain materials predicted by the witnesses of the others.
    /// None for too few of them.
    pub rank_correlation: Option<f64>,
}

impl LossPredictor {
    /// By ridge regression on logarithms of losses; the bias such that the plain materials of each fold,
    /// predicted by the witnesses of the others, have the mean loss that is predicted. None if there is
    /// nothing to go by, or if a weight is none that a recipe can have.
    #[must_use]
    pub fn new(witnesses: &[HeldOutLoss], folds: usize) -> Option<Self> {
        let mut weights = regression(witnesses.iter())?;
        let (unseen, found) = unseen(witnesses, folds)?;
        let ratio = found.iter().sum::<f64>() / unseen.iter().sum::<f64>();
        weights[0] += ratio.ln() as f32;
        let kept = |weight: &f32| weight.abs() <= MAX_PREDICTION;
        weights.iter().all(kept).then(|| Self {
            rank_correlation: rank_correlation(&unseen, &found),
            weights,
        })
    }

    /// The loss that it predicts.
    #[must_use]
    pub fn loss(&self, coefficients: &[f32]) -> f64 {
        predicted(&self.weights, coefficients)
    }
}

/// Losses of plain materials as witnesses of the other folds predict them, and as they are.
fn unseen(witnesses: &[HeldOutLoss], folds: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut pairs = Vec::new();
    for fold in 0..folds {
        let weights = regression(witnesses.iter().filter(|each| each.fold != fold))?;
        let own = witnesses
            .iter()
            .filter(|each| each.fold == fold && each.plain);
        pairs.extend(own.map(|each| {
            let loss = predicted(&weights, &each.coefficients);
            (loss, f64::from(each.loss))
        }));
    }
    Some(pairs.into_iter().unzip())
}

/// The loss that weights predict.
fn predicted(weights: &[f32], coefficients: &[f32]) -> f64 {
    let products = weights[1..].iter().zip(coefficients);
    let sum: f64 = products.map(|(w, a)| f64::from(*w) * f64::from(*a)).sum();
    (f64::from(weights[0]) + sum).exp()
}

/// A bias and slopes by ridge regression on logarithms of losses; the bias such that the losses of the
/// plain materials among the witnesses have the mean that is predicted.
fn regression<'w>(witnesses: impl Iterator<Item = &'w HeldOutLoss>) -> Option<Vec<f32>> {
    let rows: Vec<&HeldOutLoss> = witnesses.filter(|each| each.loss > 0.0).collect();
    let width = rows.first()?.coefficients.len();
    let count = rows.len() as f64;
    let mut features =
        DMatrix::from_fn(rows.len(), width, |i, j| f64::from(rows[i].coefficients[j]));
    let mut losses = DVector::from_fn(rows.len(), |i, _| f64::from(rows[i].loss).ln());
    losses.add_scalar_mut(-losses.mean());
    let mut sizes = Vec::with_capacity(width);
    for mut column in features.column_iter_mut() {
        column.add_scalar_mut(-column.mean());
        let size = (column.norm_squared() / count).sqrt().max(1e-6);
        column /= size;
        sizes.push(size);
    }
    let mut normal = features.tr_mul(&features) / count;
    for k in 0..width {
        normal[(k, k)] += RIDGE;
    }
    let solved = normal
        .cholesky()?
        .solve(&(features.tr_mul(&losses) / count));
    let slopes = solved.iter().zip(sizes).map(|(slope, size)| slope / size);
    let mut weights: Vec<f32> = std::iter::once(0.0)
        .chain(slopes)
        .map(|w| w as f32)
        .collect();
    let plain = || rows.iter().filter(|each| each.plain);
    let found: f64 = plain().map(|each| f64::from(each.loss)).sum();
    let unbiased: f64 = plain()
        .map(|each| predicted(&weights, &each.coefficients))
        .sum();
    weights[0] = (found / unbiased).ln() as f32;
    Some(weights)
}

/// Spearman's rank correlation of two lists of as many numbers; None if all of one are equal, or where
/// there are none.
#[must_use]
pub fn rank_correlation(one: &[f64], other: &[f64]) -> Option<f64> {
    correlation(&ranks(one), &ranks(other))
}

/// The place of each number among all, the least first.
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

    /// A loss that its coefficients tell, but for a share of chance.
    fn witnesses(chance: f32) -> Vec<HeldOutLoss> {
        witnesses_from(0, chance)
    }

    fn witnesses_from(first: usize, chance: f32) -> Vec<HeldOutLoss> {
        let wave = |index: usize, by: f32| (by * index as f32).sin();
        (first..first + 400)
            .map(|index| {
                let coefficients = vec![wave(index, 0.7), wave(index, 1.3), wave(index, 2.9)];
                let told = 0.8 * coefficients[0] - 0.3 * coefficients[2] - 4.0;
                HeldOutLoss {
                    loss: (told + chance * wave(index, 37.1)).exp(),
                    coefficients,
                    plain: index % 4 == 0,
                    fold: index / 4 % 4,
                }
            })
            .collect()
    }

    #[test]
    fn what_coefficients_tell_is_predicted() {
        let witnesses = witnesses(0.0);
        let found = LossPredictor::new(&witnesses, 4).expect("there is something to go by");
        for each in &witnesses {
            let ratio = found.loss(&each.coefficients) / f64::from(each.loss);
            assert!((0.97..1.03).contains(&ratio), "{ratio}");
        }
        assert!(found.rank_correlation > Some(0.99), "{found:?}");
    }

    #[test]
    fn the_mean_of_unseen_losses_is_right_where_single_ones_are_not() {
        let witnesses = witnesses(0.6);
        let found = LossPredictor::new(&witnesses, 4).expect("there is something to go by");
        let (mut predicted, mut lost) = (0.0, 0.0);
        // Others of the same kind.
        for each in witnesses_from(400, 0.6) {
            predicted += found.loss(&each.coefficients);
            lost += f64::from(each.loss);
        }
        assert!(
            (predicted / lost - 1.0).abs() < 0.1,
            "{predicted} and {lost}"
        );
        let rank = found.rank_correlation.expect("four folds");
        assert!((0.6..0.95).contains(&rank), "{rank}");
    }

    #[test]
    fn nothing_is_predicted_of_nothing() {
        let mut wild = witnesses(0.0);
        for each in &mut wild {
            each.coefficients[0] *= 1e-6;
        }
        assert_eq!(
            LossPredictor::new(&wild, 4),
            None,
            "weights beyond a recipe's"
        );
        assert_eq!(LossPredictor::new(&[], 4), None);
        assert_eq!(ranks(&[3.0, 1.0, 2.0]), [2.0, 0.0, 1.0]);
    }
}
