//! The prediction of the loss of a fit from its completed coefficients and the evidence of its readings.

use glimpse_core::fit::Prediction;
use glimpse_core::fit::prediction::{MIN_INNOVATION, MIN_RESIDUAL};
use glimpse_fitting::recipe::expected_loss::LossEstimate;
use glimpse_fitting::recipe::sections::Arena;
use nalgebra::{DMatrix, DVector};

/// The ridge penalty of the weights of coefficients, for features normalized to a mean square of 1. The weights of the
/// evidence have almost none.
const RIDGE: f64 = 0.01;
/// The penalty of the weights of the evidence, for a system that is not singular.
const MIN_RIDGE: f64 = 1e-6;
/// The number of features of the evidence.
const EVIDENCE: usize = 2;
/// The share of held-out tasks for which the upper bound holds. It exceeds the stated 90 %, for materials less like the
/// training than all held-out ones.
const COVERAGE: f64 = 0.94;
/// The share of held-out tasks for which the upper bound after some of the readings holds. It is larger, because a scan may
/// end after each of its readings.
const PARTIAL_COVERAGE: f64 = 0.97;
/// The share of materials like those of the training whose innovation is not unusual.
const LIKE_TRAINING: f64 = 0.99;

/// The largest weight of a recipe's prediction.
const MAX_PREDICTION: f32 = 1e4;

/// The evidence of readings for the loss of a fit.
#[derive(Clone, Copy, Debug)]
pub struct LossEvidence {
    /// The mean difference of logarithms between the readings and the completion before its correction.
    pub innovation: f32,
    /// The mean residual at the readings.
    pub residual: f32,
}

impl LossEvidence {
    /// Returns the feature of the innovation.
    #[must_use]
    pub fn log_innovation(&self) -> f32 {
        (self.innovation + MIN_INNOVATION).ln()
    }

    /// Returns the feature of the residual.
    #[must_use]
    pub fn log_residual(&self) -> f32 {
        (self.residual + MIN_RESIDUAL).ln()
    }
}

/// The completed coefficients of a material, and the loss of its fit by a recipe trained without it.
#[derive(Clone, Debug)]
pub struct HeldOutLoss {
    /// The mean of each coefficient over channels.
    pub coefficients: Vec<f32>,
    /// The evidence of the readings, by a recipe trained without the material.
    pub evidence: LossEvidence,
    /// The loss.
    pub loss: f32,
    /// The index of the material among all of the training; for an augmentation, that of its first material.
    pub material: usize,
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
    /// A training material of a source that was left out.
    Source,
    /// A procedural material of a class that was left out.
    Class,
    /// An augmentation of either with a rough BRDF.
    Rough,
}

impl HeldOutOrigin {
    const ALL: [Self; 4] = [Self::Material, Self::Source, Self::Class, Self::Rough];

    /// Returns true for materials of the training set, and false for procedural and augmented ones.
    #[must_use]
    pub fn is_training_material(self) -> bool {
        matches!(self, Self::Material | Self::Source)
    }

    /// Returns the weight of all losses of this origin. Materials of another source and rough ones weigh most, because the
    /// materials of users rarely come from the source of the training.
    fn weight(self) -> f64 {
        match self {
            Self::Material | Self::Class => 1.0 / 6.0,
            Self::Source | Self::Rough => 2.0 / 3.0,
        }
    }
}

/// A held-out loss, and its weight in the regression.
type Weighted<'w> = (f64, &'w HeldOutLoss);

/// Returns the losses above 0 with their weights.
fn weigh(held_out: &[HeldOutLoss]) -> Vec<Weighted<'_>> {
    let of = |origin| move |each: &&HeldOutLoss| each.origin == origin && each.loss > 0.0;
    let all = HeldOutOrigin::ALL.into_iter().flat_map(|origin| {
        let count = held_out.iter().filter(of(origin)).count();
        let weight = origin.weight() / count.max(1) as f64;
        held_out
            .iter()
            .filter(of(origin))
            .map(move |each| (weight, each))
    });
    all.collect()
}

impl HeldOutLoss {
    /// Returns the coefficients, and the logarithms of innovation and residual.
    fn features(&self) -> Vec<f32> {
        let mut features = self.coefficients.clone();
        features.extend([self.evidence.log_innovation(), self.evidence.log_residual()]);
        features
    }
}

/// A log-linear predictor of the loss: the exponential of a bias plus weighted coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct LossPredictor {
    /// The bias, one weight per coefficient, and those of the logarithms of innovation and residual; see
    /// [`glimpse_core::fit::prediction`].
    pub weights: Vec<f32>,
    /// The ratio of the upper bound to the predicted loss.
    pub bound: f32,
    /// The largest innovation of a material like those of the training.
    pub max_innovation: f32,
    /// Spearman's rank correlation of predicted and actual losses on plain materials. The losses of a fold are
    /// predicted by a regression on the other folds. None for fewer than two plain materials.
    pub rank_correlation: Option<f64>,
    /// The mean held-out loss of the materials of each source. Empty for a single source.
    pub source_losses: Vec<LossEstimate>,
    /// The prediction for scans that end early. None if the recipe needs all readings.
    pub partial: Option<PartialPrediction>,
}

/// The prediction for scans that end early: a number for each number of readings, 1 to n.
#[derive(Clone, Debug, PartialEq)]
pub struct PartialPrediction {
    /// The logarithm of the factor of the predicted loss.
    pub loss: Vec<f32>,
    /// The ratio of the upper bound to the predicted loss.
    pub bound: Vec<f32>,
}

impl LossPredictor {
    /// Fits the predictor by ridge regression on the logarithms of losses. The bias includes a correction, which makes
    /// the mean cross-validated prediction equal to the mean loss. All means are weighted.
    ///
    /// Returns None without data, or if a weight exceeds the range of recipes.
    #[must_use]
    pub fn new(held_out: &[HeldOutLoss], folds: usize) -> Option<Self> {
        let held_out = weigh(held_out);
        let mut weights = regression(held_out.iter().copied())?;
        let pairs = cross_validate(&held_out, folds)?;
        let [actual, predicted] = [0, 1].map(|index| {
            let products = pairs.iter().map(|((weight, _), pair)| weight * pair[index]);
            products.sum::<f64>()
        });
        let ratio = actual / predicted;
        weights[0] += ratio.ln() as f32;
        let ratios = pairs
            .iter()
            .map(|((weight, _), [actual, predicted])| (*weight, actual / (ratio * predicted)));
        let bound = quantile(ratios.collect(), COVERAGE)?.max(1.0);
        let smooth = held_out
            .iter()
            .filter(|(_, each)| each.origin != HeldOutOrigin::Rough);
        let innovations =
            smooth.map(|(weight, each)| (*weight, f64::from(each.evidence.innovation)));
        let max_innovation = quantile(innovations.collect(), LIKE_TRAINING)?;
        let (actual, predicted): (Vec<f64>, Vec<f64>) = pairs
            .iter()
            .filter(|((_, each), _)| each.origin.is_training_material())
            .map(|(_, [actual, predicted])| (*actual, *predicted))
            .unzip();
        let mut others = weights.iter().rev().skip(EVIDENCE);
        let is_in_range = others.all(|weight| weight.abs() <= MAX_PREDICTION);
        is_in_range.then(|| Self {
            rank_correlation: rank_correlation(&predicted, &actual),
            weights,
            bound: bound as f32,
            max_innovation: (max_innovation as f32).max(f32::MIN_POSITIVE),
            source_losses: Vec::new(),
            partial: None,
        })
    }

    /// Adds the mean held-out loss of each source, given their numbers of materials in order.
    #[must_use]
    pub fn with_sources(mut self, held_out: &[HeldOutLoss], counts: &[usize]) -> Self {
        if counts.len() < 2 {
            return self;
        }
        let mut first = 0;
        for count in counts {
            let range = first..first + count;
            first = range.end;
            let of_source = held_out.iter().filter(|each| {
                each.origin.is_training_material() && range.contains(&each.material)
            });
            let losses: Vec<f64> = of_source.map(|each| f64::from(each.loss)).collect();
            let mean = losses.iter().sum::<f64>() / losses.len() as f64;
            self.source_losses
                .push(LossEstimate::new(mean as f32, losses.into_iter()));
        }
        self
    }

    /// Returns the section of a recipe.
    pub(crate) fn section<'a>(&self, arena: &'a Arena) -> Prediction<'a> {
        let partial = self.partial.as_ref();
        let (weights, evidence) = self.weights.split_at(self.weights.len() - EVIDENCE);
        Prediction {
            weights: arena.floats(weights),
            innovation: evidence[0],
            residual: evidence[1],
            bound: self.bound,
            max_innovation: self.max_innovation,
            partial_loss: arena.floats(partial.map_or(&[], |partial| &partial.loss)),
            partial_bound: arena.floats(partial.map_or(&[], |partial| &partial.bound)),
        }
    }

    /// Adds the prediction for scans that end early, given the held-out losses for some numbers of readings, in ascending
    /// order. Other numbers of readings are interpolated.
    ///
    /// `held_out` has materials of the training's sources and classes only: with rough ones, few scans would end early. The
    /// prediction for all readings remains unchanged.
    #[must_use]
    pub fn with_partial(mut self, held_out: &[(usize, Vec<HeldOutLoss>)], samples: usize) -> Self {
        let known = held_out.iter().filter_map(|(count, held_out)| {
            let held_out = weigh(held_out);
            let pairs = held_out
                .iter()
                .map(|(weight, each)| (*weight, f64::from(each.loss), self.loss(each)));
            let mean = |value: fn((f64, f64, f64)) -> f64| pairs.clone().map(value).sum::<f64>();
            let factor = mean(|(weight, loss, _)| weight * loss)
                / mean(|(weight, _, predicted)| weight * predicted);
            let ratios = pairs
                .clone()
                .map(|(weight, loss, predicted)| (weight, loss / (factor * predicted)));
            let bound = quantile(ratios.collect(), PARTIAL_COVERAGE)?.max(1.0);
            Some((*count, [factor.ln() as f32, bound as f32]))
        });
        let known: Vec<(usize, [f32; 2])> = known.collect();
        let is_finite = |(_, [factor, bound]): &(usize, [f32; 2])| (factor + bound).is_finite();
        if known.is_empty() || !known.iter().all(is_finite) {
            return self;
        }
        let partial = (1..samples).map(|count| interpolate(&known, count));
        let complete = [0.0, self.bound];
        let all = partial.chain([complete]);
        let (loss, bound) = all.map(|[loss, bound]| (loss, bound)).unzip();
        self.partial = Some(PartialPrediction { loss, bound });
        self
    }

    /// Returns the predicted loss of a held-out material.
    #[must_use]
    pub fn loss(&self, held_out: &HeldOutLoss) -> f64 {
        predict(&self.weights, &held_out.features())
    }
}

/// Interpolates pairs of numbers, known for at least one count, in ascending order.
fn interpolate(known: &[(usize, [f32; 2])], count: usize) -> [f32; 2] {
    let next = known.partition_point(|(known, _)| *known < count);
    let (from, low) = known[next.saturating_sub(1)];
    let (to, high) = known[next.min(known.len() - 1)];
    if from == to {
        return low; // before the first count, or after the last one
    }
    let share = (count - from) as f32 / (to - from) as f32;
    [0, 1].map(|i| low[i] + share * (high[i] - low[i]))
}

/// Returns the smallest of weighted values that at least `share` of the total weight does not exceed.
fn quantile(mut values: Vec<(f64, f64)>, share: f64) -> Option<f64> {
    values.sort_by(|(_, one), (_, other)| one.total_cmp(other));
    let total: f64 = values.iter().map(|(weight, _)| weight).sum();
    let mut rest = share * total;
    let reaches = |(weight, _): &&(f64, f64)| {
        rest -= weight;
        rest <= 0.0
    };
    let found = values.iter().find(reaches).or(values.last());
    found.map(|(_, value)| *value)
}

/// Returns the actual and the predicted loss of each. The losses of a fold are predicted by a regression on the other
/// folds.
fn cross_validate<'w>(
    held_out: &[Weighted<'w>],
    folds: usize,
) -> Option<Vec<(Weighted<'w>, [f64; 2])>> {
    let mut pairs = Vec::new();
    for fold in 0..folds {
        let others = held_out.iter().filter(|(_, each)| each.fold != fold);
        let weights = regression(others.copied())?;
        let own = held_out.iter().filter(|(_, each)| each.fold == fold);
        pairs.extend(own.map(|(weight, each)| {
            let predicted = predict(&weights, &each.features());
            ((*weight, *each), [f64::from(each.loss), predicted])
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

/// Fits a bias and slopes by weighted ridge regression on the logarithms of losses. The bias makes the mean prediction
/// equal to the mean loss.
fn regression<'w>(held_out: impl Iterator<Item = Weighted<'w>>) -> Option<Vec<f32>> {
    let (shares, rows): (Vec<f64>, Vec<&HeldOutLoss>) = held_out.unzip();
    let total: f64 = shares.iter().sum();
    let lists: Vec<Vec<f32>> = rows.iter().map(|each| each.features()).collect();
    let width = lists.first()?.len();
    let share = DVector::from_iterator(shares.len(), shares.iter().map(|share| share / total));
    // Columns are multiplied by the roots of the shares after centering, so that products are weighted means.
    let roots = share.map(f64::sqrt);
    let center = |mut column: DVector<f64>| {
        column.add_scalar_mut(-share.dot(&column));
        column.component_mul(&roots)
    };
    let mut features = DMatrix::zeros(rows.len(), width);
    let mut scales = Vec::with_capacity(width);
    for k in 0..width {
        let column = lists.iter().map(|features| f64::from(features[k]));
        let column = center(DVector::from_iterator(rows.len(), column));
        let scale = column.norm().max(1e-6);
        features.set_column(k, &(column / scale));
        scales.push(scale);
    }
    let logarithms = rows.iter().map(|each| f64::from(each.loss).ln());
    let losses = center(DVector::from_iterator(rows.len(), logarithms));
    let mut normal = features.tr_mul(&features);
    for k in 0..width {
        normal[(k, k)] += match k + EVIDENCE < width {
            true => RIDGE,
            false => MIN_RIDGE,
        };
    }
    let normalized_slopes = normal.cholesky()?.solve(&features.tr_mul(&losses));
    let slopes = normalized_slopes
        .iter()
        .zip(scales)
        .map(|(slope, scale)| slope / scale);
    let mut weights: Vec<f32> = std::iter::once(0.0)
        .chain(slopes)
        .map(|w| w as f32)
        .collect();
    let products = |value: &dyn Fn(&HeldOutLoss) -> f64| -> f64 {
        let each = shares.iter().zip(&rows);
        each.map(|(share, each)| share * value(each)).sum()
    };
    let actual = products(&|each| f64::from(each.loss));
    let uncorrected = products(&|each| predict(&weights, &each.features()));
    weights[0] = (actual / uncorrected).ln() as f32;
    Some(weights)
}

/// Returns Spearman's rank correlation of two lists of equal length; None for fewer than two different numbers.
#[must_use]
pub fn rank_correlation(one: &[f64], other: &[f64]) -> Option<f64> {
    let count = one.len() as f64;
    let centered = |list: &[f64]| {
        let ranks = ranks(list);
        let mean = ranks.iter().sum::<f64>() / count;
        DVector::from_iterator(ranks.len(), ranks.iter().map(|rank| rank - mean))
    };
    let (one, other) = (centered(one), centered(other));
    let norms = one.norm() * other.norm();
    (norms > 0.0).then(|| one.dot(&other) / norms)
}

/// Returns the rank of each number, starting with 0 for the smallest. Equal numbers share the mean of their ranks.
fn ranks(numbers: &[f64]) -> Vec<f64> {
    let count = |is_counted: &dyn Fn(&f64) -> bool| {
        let counted = numbers.iter().filter(|other| is_counted(other));
        counted.count() as f64
    };
    let rank = |number: &f64| {
        let smaller = count(&|other| other.total_cmp(number).is_lt());
        let equal = count(&|other| other.total_cmp(number).is_eq());
        smaller + 0.5 * (equal - 1.0)
    };
    numbers.iter().map(rank).collect()
}

#[cfg(test)]
mod tests;
