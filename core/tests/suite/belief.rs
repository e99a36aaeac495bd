//! The belief about a material matches dense conditioning, in f64 and in f32, and predicts what readings tell.

use glimpse_core::fit::belief::{Belief, Predicted, Weights, belief_length, weights_length};
use glimpse_core::numeric::Real;

use crate::random::Random;

const K: usize = 12;
const NOISE: f64 = 0.02;

/// A covariance and expected coefficients, conditioned by their definitions.
struct Dense {
    covariance: Vec<Vec<f64>>,
    expected: Vec<f64>,
}

impl Dense {
    fn new(variances: &[f64]) -> Self {
        let row = |i: usize| {
            (0..K)
                .map(|j| if i == j { variances[i] } else { 0.0 })
                .collect()
        };
        Self {
            covariance: (0..K).map(row).collect(),
            expected: vec![0.0; K],
        }
    }

    fn times(&self, row: &[f64]) -> Vec<f64> {
        let dot = |line: &Vec<f64>| line.iter().zip(row).map(|(a, b)| a * b).sum();
        self.covariance.iter().map(dot).collect()
    }

    fn variance(&self, row: &[f64]) -> f64 {
        self.times(row).iter().zip(row).map(|(a, b)| a * b).sum()
    }

    fn add(&mut self, row: &[f64], target: f64, noise: f64) {
        let gain = self.times(row);
        let total = self.variance(row) + noise;
        let rest = target
            - self
                .expected
                .iter()
                .zip(row)
                .map(|(a, b)| a * b)
                .sum::<f64>();
        for (i, line) in self.covariance.iter_mut().enumerate() {
            self.expected[i] += gain[i] * rest / total;
            for (entry, other) in line.iter_mut().zip(&gain) {
                *entry -= gain[i] * other / total;
            }
        }
    }
}

/// Variances over four decades, as those of principal components, and readings.
struct Case {
    variances: [Vec<f64>; 2],
    rows: Vec<Vec<f64>>,
    targets: Vec<[f64; 3]>,
}

fn case(readings: usize) -> Case {
    let mut random = Random(readings as u64);
    let variance = |scale: f64| {
        (0..K)
            .map(|k| scale * 10_f64.powf(2.0 - k as f64 / 3.0))
            .collect()
    };
    let rows = (0..readings).map(|_| (0..K).map(|_| random.normal()).collect());
    let rows: Vec<Vec<f64>> = rows.collect();
    let targets = rows
        .iter()
        .map(|_| [0, 1, 2].map(|_| 3.0 * random.normal()));
    Case {
        variances: [variance(1.0), variance(0.2)],
        targets: targets.collect(),
        rows,
    }
}

fn list<S: Real>(values: &[f64]) -> Vec<S> {
    values.iter().map(|value| S::constant(*value)).collect()
}

/// Returns the belief after all readings but the last ones.
fn belief<S: Real>(case: &Case, without: usize) -> Belief<S, Vec<S>> {
    let memory = vec![S::constant(f64::NAN); belief_length(K)];
    let variances = case.variances.each_ref().map(|each| list(each).into_iter());
    let mut belief = Belief::new(variances, memory).expect("the memory is long enough");
    let count = case.rows.len() - without;
    for (row, targets) in case.rows.iter().zip(&case.targets).take(count) {
        let noise = S::constant(NOISE);
        belief.add(&list(row), targets.map(S::constant), noise);
    }
    belief
}

/// Returns the largest difference of expectations and of standard deviations from those of dense conditioning.
fn error<S: Real + Into<f64>>(case: &Case) -> f64 {
    let belief = belief::<S>(case, 0);
    let [mean, difference] = case.variances.each_ref().map(|each| Dense::new(each));
    let mut lists = [
        mean,
        Dense::new(&case.variances[1]),
        Dense::new(&case.variances[1]),
        difference,
    ];
    for (row, targets) in case.rows.iter().zip(&case.targets) {
        let average = targets.iter().sum::<f64>() / 3.0;
        lists[0].add(row, average, NOISE / 3.0);
        for (list, target) in lists[1..].iter_mut().zip(targets) {
            list.add(row, target - average, NOISE);
        }
    }
    let mut error = 0.0_f64;
    let mut coefficients = belief.coefficients().map(Into::<f64>::into);
    for channel in &lists[1..] {
        for (mean, difference) in lists[0].expected.iter().zip(&channel.expected) {
            error = error.max((coefficients.next().expect("3 K") - mean - difference).abs());
        }
    }
    for row in case.rows.iter().chain(&self::case(40).rows) {
        let Predicted { variance, .. } = belief.predict(&list::<S>(row));
        for (variance, list) in variance.map(Into::<f64>::into).into_iter().zip(&lists) {
            assert!(variance > 0.0);
            error = error.max((variance.sqrt() - list.variance(row).sqrt()).abs());
        }
    }
    error
}

#[test]
fn belief_matches_dense_conditioning() {
    for readings in [1, 5, 12, 100] {
        let case = case(readings);
        let double = error::<f64>(&case);
        assert!(double < 1e-9, "{readings} readings: {double}");
        let single = error::<f32>(&case);
        assert!(single < 2e-3, "{readings} readings in f32: {single}");
    }
}

/// The reduction is that of the expected losses, for a reading that reduces them little.
#[test]
fn reduction_is_that_of_the_expected_losses() {
    let case = case(30);
    let mut belief = belief::<f64>(&case, 10);
    let (loss_rows, rows) = (&case.rows[..20], &case.rows[20..]);
    let weights = |belief: &Belief<f64, Vec<f64>>| {
        let mut weights = Weights::new(vec![0.0; weights_length(K)]);
        for row in loss_rows {
            // Small expected values, so that the function is smooth.
            let expected = [0.5, 0.6, 0.7];
            let predicted = Predicted {
                expected,
                ..belief.predict(row)
            };
            weights.add(row, &predicted, 3.0, 0.8, 0.5);
        }
        weights
    };
    // With a large noise.
    let noise = 100.0 * NOISE;
    let before = weights(&belief);
    for row in rows {
        let predicted = belief.reduction(row, noise, &before);
        let mut after = belief.clone();
        after.assume(row, noise);
        let actual = before.loss() - weights(&after).loss();
        assert!(
            actual > 0.0 && (predicted / actual - 1.0).abs() < 0.1,
            "{predicted} {actual}"
        );
        // Expectations do not change.
        let [old, new] = [&belief, &after].map(|each| each.predict(&rows[0]).expected[1]);
        assert!((old - new).abs() < 1e-9);
        assert!((belief.evidence() - after.evidence()).abs() < 1e-9);
    }
}

#[test]
fn short_memory_is_refused() {
    let case = case(1);
    let variances = || case.variances.each_ref().map(|each| each.iter().copied());
    assert!(Belief::new(variances(), vec![0.0; belief_length(K) - 1]).is_none());
    assert!(Belief::new(variances(), vec![0.0; belief_length(K)]).is_some());
}
