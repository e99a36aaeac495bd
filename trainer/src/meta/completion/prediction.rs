//! The error bar of a completion: from its coefficients to the loss that a fit is likely to have.

use nalgebra::{DMatrix, DVector};

/// What may hold weights near 0, beside a mean square of 1 that features have.
const RIDGES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];

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
    /// How well it ranks losses of materials that it does not go by: Spearman's rank correlation, each
    /// fold's plain materials predicted by the witnesses of the others. None for too few of them.
    pub rank_correlation: Option<f64>,
}

/// Losses of plain materials as they are predicted by the witnesses of other folds, and as they are.
struct Unseen {
    predicted: Vec<f64>,
    found: Vec<f64>,
}

impl Prediction {
    /// By ridge regression on logarithms of losses. How near to 0 weights are held, and the bias, are
    /// such that plain materials of folds are predicted best by the others, and right in the mean. None
    /// if there is nothing to go by.
    #[must_use]
    pub fn new(witnesses: &[Witness], folds: usize) -> Option<Self> {
        let tried = RIDGES.iter().filter_map(|ridge| {
            let unseen = Unseen::new(witnesses, folds, *ridge)?;
            Some((*ridge, unseen))
        });
        let best = tried.min_by(|(_, a), (_, b)| a.square_error().total_cmp(&b.square_error()));
        let ridge = best.as_ref().map_or(RIDGES[0], |(ridge, _)| *ridge);
        let mut weights = regression(witnesses.iter(), ridge)?;
        let unseen = best.map(|(_, unseen)| unseen);
        if let Some(unseen) = &unseen {
            weights[0] += unseen.ratio_of_means().ln() as f32;
        }
        weights
            .iter()
            .all(|weight| weight.is_finite())
            .then(|| Self {
                rank_correlation: unseen
                    .and_then(|unseen| rank_correlation(&unseen.predicted, &unseen.found)),
                weights,
            })
    }

    /// The loss that it predicts.
    #[must_use]
    pub fn loss(&self, coefficients: &[f32]) -> f64 {
        predicted(&self.weights, coefficients)
    }
}

impl Unseen {
    /// None if a fold has no witnesses outside.
    fn new(witnesses: &[Witness], folds: usize, ridge: f64) -> Option<Self> {
        let (mut predictions, mut found) = (Vec::new(), Vec::new());
        for fold in 0..folds {
            let weights = regression(witnesses.iter().filter(|each| each.fold != fold), ridge)?;
            let own = witnesses
                .iter()
                .filter(|each| each.fold == fold && each.plain && each.loss > 0.0);
            for each in own {
                predictions.push(predicted(&weights, &each.coefficients));
                found.push(f64::from(each.loss));
            }
        }
        (!found.is_empty()).then_some(Self {
            predicted: predictions,
            found,
        })
    }

    /// Of logarithms.
    fn square_error(&self) -> f64 {
        let pairs = self.predicted.iter().zip(&self.found);
        pairs
            .map(|(predicted, found)| (predicted / found).ln().powi(2))
            .sum()
    }

    /// What was found, as a share of what is predicted.
    fn ratio_of_means(&self) -> f64 {
        self.found.iter().sum::<f64>() / self.predicted.iter().sum::<f64>()
    }
}

/// The loss that weights predict.
fn predicted(weights: &[f32], coefficients: &[f32]) -> f64 {
    let products = weights[1..].iter().zip(coefficients);
    let sum: f64 = products.map(|(w, a)| f64::from(*w) * f64::from(*a)).sum();
    (f64::from(weights[0]) + sum).exp()
}

/// A bias and slopes by ridge regression on logarithms of losses; the bias such that the losses of the
/// plain materials among the witnesses have the mean that is predicted.
fn regression<'w>(witnesses: impl Iterator<Item = &'w Witness>, ridge: f64) -> Option<Vec<f32>> {
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
        normal[(k, k)] += ridge;
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
        witnesses_from(0, chance)
    }

    fn witnesses_from(first: usize, chance: f32) -> Vec<Witness> {
        let wave = |index: usize, by: f32| (by * index as f32).sin();
        (first..first + 400)
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
        let found = Prediction::new(&witnesses, 4).expect("there is something to go by");
        for each in &witnesses {
            let ratio = found.loss(&each.coefficients) / f64::from(each.loss);
            assert!((0.97..1.03).contains(&ratio), "{ratio}");
        }
        assert!(found.rank_correlation > Some(0.99), "{found:?}");
    }

    #[test]
    fn the_mean_of_unseen_losses_is_right_where_single_ones_are_not() {
        let witnesses = witnesses(0.6);
        let found = Prediction::new(&witnesses, 4).expect("there is something to go by");
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

    /// Few witnesses fit well in sample and badly outside: what is predicted goes by outside.
    #[test]
    fn few_witnesses_are_held_back() {
        let few: Vec<Witness> = witnesses(0.6)
            .into_iter()
            .filter(|each| each.plain)
            .take(24)
            .collect();
        let unseen = |ridge| Unseen::new(&few, 4, ridge).expect("four folds");
        let errors = RIDGES.map(|ridge| unseen(ridge).square_error());
        let found = Prediction::new(&few, 4).expect("there is something to go by");
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let chosen = RIDGES
            .into_iter()
            .zip(errors)
            .find(|(_, error)| *error == least);
        let (ridge, _) = chosen.expect("one is the least");
        let by_it = regression(few.iter(), ridge).expect("there is something to go by");
        assert_eq!(found.weights[1..], by_it[1..]);
        let moved = f64::from(found.weights[0] - by_it[0]).exp();
        assert!((moved / unseen(ridge).ratio_of_means() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn nothing_is_predicted_of_nothing() {
        assert_eq!(Prediction::new(&[], 4), None);
        assert_eq!(ranks(&[3.0, 1.0, 2.0]), [2.0, 0.0, 1.0]);
    }
}
