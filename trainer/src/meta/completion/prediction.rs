//! The error bar of a completion: from its coefficients to the loss that a fit is likely to have.

use nalgebra::{DMatrix, DVector};

/// What holds weights near 0, beside a mean square of 1 that features have.
const RIDGE: f64 = 0.01;

/// What was completed of one material, and the loss of its fit by what was trained without it.
#[derive(Clone, Debug)]
pub struct Witness {
    /// The mean over channels of each coefficient.
    pub coefficients: Vec<f32>,
    /// The loss.
    pub loss: f32,
    /// Whether it is a material as it is, and no variation of one.
    pub plain: bool,
    /// The fold that left it out.
    pub fold: usize,
}

/// What says which loss is likely: the exponential of a bias and weighted coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// The bias, and a weight for each coefficient.
    pub weights: Vec<f32>,
}

impl Prediction {
    /// By ridge regression on logarithms of losses; the bias such that the losses of the plain materials
    /// have the mean that is predicted. None if there is nothing to go by.
    #[must_use]
    pub fn new<'w>(witnesses: impl Iterator<Item = &'w Witness> + Clone) -> Option<Self> {
        let rows: Vec<&Witness> = witnesses.filter(|each| each.loss > 0.0).collect();
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
        let unbiased = Self {
            weights: weights.clone(),
        };
        let plain = || rows.iter().filter(|each| each.plain);
        let found: f64 = plain().map(|each| f64::from(each.loss)).sum();
        let predicted: f64 = plain().map(|each| unbiased.loss(&each.coefficients)).sum();
        weights[0] = (found / predicted).ln() as f32;
        weights
            .iter()
            .all(|weight| weight.is_finite())
            .then_some(Self { weights })
    }

    /// The loss that it predicts.
    #[must_use]
    pub fn loss(&self, coefficients: &[f32]) -> f64 {
        let products = self.weights[1..].iter().zip(coefficients);
        let sum: f64 = products.map(|(w, a)| f64::from(*w) * f64::from(*a)).sum();
        (f64::from(self.weights[0]) + sum).exp()
    }

    /// How well losses of materials are ranked that it did not see: Spearman's rank correlation, each
    /// fold's plain materials predicted by the witnesses of the others. None for too few of them.
    #[must_use]
    pub fn rank_correlation(witnesses: &[Witness], folds: usize) -> Option<f64> {
        let mut pairs = Vec::new();
        for fold in 0..folds {
            let others = witnesses.iter().filter(|each| each.fold != fold);
            let by_others = Self::new(others)?;
            let own = witnesses
                .iter()
                .filter(|each| each.fold == fold && each.plain);
            pairs
                .extend(own.map(|each| (by_others.loss(&each.coefficients), f64::from(each.loss))));
        }
        let (predicted, found): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        rank_correlation(&predicted, &found)
    }
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
    let centred = |list: &[f64]| {
        let mean = list.iter().sum::<f64>() / count;
        DVector::from_iterator(list.len(), list.iter().map(|value| value - mean))
    };
    let (one, other) = (centred(one), centred(other));
    let norms = one.norm() * other.norm();
    (norms > 0.0).then(|| one.dot(&other) / norms)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loss that its coefficients tell, but for a share of chance.
    fn witnesses(chance: f32) -> Vec<Witness> {
        let wave = |index: usize, by: f32| (by * index as f32).sin();
        (0..400)
            .map(|index| {
                let coefficients = vec![wave(index, 0.7), wave(index, 1.3), wave(index, 2.9)];
                let told = 0.8 * coefficients[0] - 0.3 * coefficients[2] - 4.0;
                Witness {
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
        let found = Prediction::new(witnesses.iter()).expect("there is something to go by");
        for each in &witnesses {
            let ratio = found.loss(&each.coefficients) / f64::from(each.loss);
            assert!((0.97..1.03).contains(&ratio), "{ratio}");
        }
        let rank = Prediction::rank_correlation(&witnesses, 4).expect("four folds");
        assert!(rank > 0.99, "{rank}");
    }

    #[test]
    fn the_mean_is_right_where_single_losses_are_not() {
        let witnesses = witnesses(0.6);
        let found = Prediction::new(witnesses.iter()).expect("there is something to go by");
        let plain = || witnesses.iter().filter(|each| each.plain);
        let predicted: f64 = plain().map(|each| found.loss(&each.coefficients)).sum();
        let lost: f64 = plain().map(|each| f64::from(each.loss)).sum();
        assert!((predicted / lost - 1.0).abs() < 1e-4);
        let rank = Prediction::rank_correlation(&witnesses, 4).expect("four folds");
        assert!((0.6..0.95).contains(&rank), "{rank}");
    }

    #[test]
    fn nothing_is_predicted_of_nothing() {
        assert_eq!(Prediction::new([].iter()), None);
        assert_eq!(ranks(&[3.0, 1.0, 2.0]), [2.0, 0.0, 1.0]);
    }
}
