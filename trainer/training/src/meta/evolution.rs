//! The evolution strategy CMA-ES (Hansen, "The CMA Evolution Strategy: A Tutorial").
//!
//! The gradient of a fit's log loss depends on a measured value only through the sign of model minus measurement, and
//! jumps where that sign changes. Exact meta-gradients contain the slopes between the jumps, but not the jumps. For
//! models with few parameters and eight samples, the jumps cause most of the change, so gradients miss most of it.
//!
//! Evolution uses only the loss. It draws candidates around a mean, and moves the mean and the covariance towards the
//! better half. It needs many evaluations, each of about 10 µs per material. With more than `MAX_CORRELATED`
//! meta-parameters, it learns variances without correlations (separable CMA-ES; Ros and Hansen 2008), which needs fewer
//! evaluations.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::initialization::standard_normal;
use glimpse_optimizer::Groups;

/// The state of an evolution. Mean, covariance and paths are in units of the initial standard deviation of each group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    /// The initial values of all groups; frozen groups keep them.
    origin: Groups<Vec<f32>>,
    /// The initial standard deviation of each group; 0 freezes the group.
    spreads: Groups<f64>,
    /// The mean, as an offset from the origin.
    mean: Vec<f64>,
    /// The step size sigma.
    sigma: f64,
    /// The covariance matrix in column-major order; only its diagonal for separable CMA-ES.
    covariance: Vec<f64>,
    /// The evolution path of the covariance.
    path: Vec<f64>,
    /// The evolution path of sigma.
    sigma_path: Vec<f64>,
    generation: i32,
}

/// The constants of the strategy, named as in the tutorial.
struct Constants {
    weights: Vec<f64>,
    mu_eff: f64,
    c_c: f64,
    c_sigma: f64,
    c_1: f64,
    c_mu: f64,
    damping: f64,
    chi: f64,
}

/// The maximum number of meta-parameters with learned correlations.
const MAX_CORRELATED: usize = 128;

impl Constants {
    fn new(dimensions: usize, population: usize) -> Self {
        let n = dimensions as f64;
        let mu = population / 2;
        let logarithms = (1..=mu).map(|i| (mu as f64 + 0.5).ln() - (i as f64).ln());
        let sum: f64 = logarithms.clone().sum();
        let weights: Vec<f64> = logarithms.map(|weight| weight / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        // A diagonal covariance allows higher learning rates.
        let rate_factor = match dimensions > MAX_CORRELATED {
            true => (n + 2.0) / 3.0,
            false => 1.0,
        };
        let c_1 = (rate_factor * 2.0 / ((n + 1.3).powi(2) + mu_eff)).min(1.0);
        let c_mu = rate_factor * 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff);
        let overshoot = ((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0;
        Self {
            mu_eff,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_sigma,
            c_1,
            c_mu: c_mu.min(1.0 - c_1),
            damping: 1.0 + 2.0 * overshoot.max(0.0) + c_sigma,
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            weights,
        }
    }
}

impl Evolution {
    /// Creates an evolution with mean `origin`, and with an initial standard deviation for each group.
    #[must_use]
    pub fn new(origin: Groups<Vec<f32>>, spreads: Groups<f64>) -> Self {
        let free_count = |(values, spread): (&Vec<f32>, &f64)| match *spread > 0.0 {
            true => values.len(),
            false => 0,
        };
        let dimensions = origin
            .each()
            .into_iter()
            .zip(spreads.each())
            .map(free_count)
            .sum();
        Self {
            mean: vec![0.0; dimensions],
            sigma: 1.0,
            covariance: match dimensions > MAX_CORRELATED {
                true => vec![1.0; dimensions],
                false => DMatrix::<f64>::identity(dimensions, dimensions)
                    .as_slice()
                    .to_vec(),
            },
            path: vec![0.0; dimensions],
            sigma_path: vec![0.0; dimensions],
            generation: 0,
            origin,
            spreads,
        }
    }

    /// Returns the meta-parameters at the mean.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        self.values_at(&self.mean)
    }

    /// Returns the meta-parameters at an offset from the origin.
    fn values_at(&self, offset: &[f64]) -> Groups<Vec<f32>> {
        let mut values = self.origin.clone();
        let mut rest = offset;
        for (group, spread) in values.each_mut().into_iter().zip(self.spreads.each()) {
            if *spread > 0.0 {
                let (group_offset, next) = rest.split_at(group.len());
                for (value, offset) in group.iter_mut().zip(group_offset) {
                    *value = (f64::from(*value) + spread * offset) as f32;
                }
                rest = next;
            }
        }
        values
    }

    /// Runs one generation: draws candidates, evaluates their losses with `losses`, and updates the distribution.
    /// Returns the smallest loss.
    pub fn advance(
        &mut self,
        population: usize,
        random: &mut ChaCha8Rng,
        losses: impl FnOnce(&[Groups<Vec<f32>>]) -> Vec<f32>,
    ) -> f32 {
        let constants = Constants::new(self.mean.len(), population);
        let root = CovarianceRoot::new(self.mean.len(), &self.covariance);
        let steps = self.draw(&root, population, random);
        let candidates: Vec<Groups<Vec<f32>>> =
            steps.iter().map(|step| self.candidate(step)).collect();
        let losses = losses(&candidates);
        let loss = |index: &usize| match losses.get(*index) {
            Some(loss) if loss.is_finite() => *loss,
            _ => f32::MAX,
        };
        let mut order: Vec<usize> = (0..population).collect();
        order.sort_by(|a, b| loss(a).total_cmp(&loss(b)).then(a.cmp(b)));
        let selected: Vec<(f64, &DVector<f64>)> = order
            .iter()
            .zip(&constants.weights)
            .map(|(index, weight)| (*weight, &steps[*index]))
            .collect();
        self.update(&constants, &root, &selected);
        order.first().map_or(f32::NAN, loss)
    }

    /// Draws steps from the mean, in units of sigma.
    fn draw(
        &self,
        root: &CovarianceRoot,
        population: usize,
        random: &mut ChaCha8Rng,
    ) -> Vec<DVector<f64>> {
        let dimensions = self.mean.len();
        (0..population)
            .map(|_| {
                let normal =
                    DVector::from_fn(dimensions, |_, _| f64::from(standard_normal(random)));
                root.color(&normal)
            })
            .collect()
    }

    /// Returns the meta-parameters at a step from the mean.
    fn candidate(&self, step: &DVector<f64>) -> Groups<Vec<f32>> {
        let entries = self.mean.iter().zip(step.iter());
        let offset: Vec<f64> = entries.map(|(mean, y)| mean + self.sigma * y).collect();
        self.values_at(&offset)
    }

    /// Updates mean, paths, covariance and sigma with the weighted steps of the better half.
    fn update(
        &mut self,
        constants: &Constants,
        root: &CovarianceRoot,
        selected: &[(f64, &DVector<f64>)],
    ) {
        let n = self.mean.len();
        let mut step = DVector::zeros(n);
        for (weight, y) in selected {
            step.axpy(*weight, y, 1.0);
        }
        for (mean, y) in self.mean.iter_mut().zip(step.iter()) {
            *mean += self.sigma * y;
        }

        let Constants {
            c_sigma,
            c_c,
            mu_eff,
            chi,
            damping,
            ..
        } = *constants;
        self.generation += 1;
        let mut sigma_path = DVector::from_column_slice(&self.sigma_path);
        sigma_path.axpy(
            (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt(),
            &root.whiten(&step),
            1.0 - c_sigma,
        );
        let bias_correction = (1.0 - (1.0 - c_sigma).powi(2 * self.generation)).sqrt();
        let length = sigma_path.norm();
        let is_stalled = length / bias_correction / chi >= 1.4 + 2.0 / (n as f64 + 1.0);
        let h_sigma = if is_stalled { 0.0 } else { 1.0 };
        let mut path = DVector::from_column_slice(&self.path);
        path.axpy(
            h_sigma * (c_c * (2.0 - c_c) * mu_eff).sqrt(),
            &step,
            1.0 - c_c,
        );
        self.update_covariance(constants, h_sigma, &path, selected);
        self.sigma *= ((c_sigma / damping) * (length / chi - 1.0)).exp();
        self.path = path.as_slice().to_vec();
        self.sigma_path = sigma_path.as_slice().to_vec();
    }

    /// Updates the covariance with the outer products of its path and of the selected steps.
    fn update_covariance(
        &mut self,
        constants: &Constants,
        h_sigma: f64,
        path: &DVector<f64>,
        selected: &[(f64, &DVector<f64>)],
    ) {
        let Constants { c_c, c_1, c_mu, .. } = *constants;
        let n = self.mean.len();
        let decay = 1.0 - c_1 - c_mu + c_1 * (1.0 - h_sigma) * c_c * (2.0 - c_c);
        let steps = selected.iter().map(|(weight, y)| (c_mu * weight, *y));
        let outer_products = [(c_1, path)].into_iter().chain(steps);
        if self.covariance.len() == n {
            for (row, variance) in self.covariance.iter_mut().enumerate() {
                let added = outer_products
                    .clone()
                    .map(|(share, y)| share * y[row] * y[row]);
                *variance = decay * *variance + added.sum::<f64>();
            }
        } else {
            let mut covariance = DMatrix::from_column_slice(n, n, &self.covariance);
            covariance *= decay;
            for (share, y) in outer_products {
                covariance.ger(share, y, y, 1.0);
            }
            self.covariance = covariance.as_slice().to_vec();
        }
    }
}

/// The square root of the covariance matrix, by its eigenvalues and eigenvectors. It is computed from saved values
/// only, so that a resumed evolution draws the same candidates.
struct CovarianceRoot {
    /// The eigenvectors as columns; None if the matrix is diagonal.
    eigenvectors: Option<DMatrix<f64>>,
    /// The square roots of the eigenvalues.
    lengths: DVector<f64>,
}

impl CovarianceRoot {
    fn new(n: usize, covariance: &[f64]) -> Self {
        let length = |variance: f64| variance.max(1e-20).sqrt();
        if covariance.len() == n {
            return Self {
                eigenvectors: None,
                lengths: DVector::from_column_slice(covariance).map(length),
            };
        }
        let eigen = SymmetricEigen::new(DMatrix::from_column_slice(n, n, covariance));
        Self {
            eigenvectors: Some(eigen.eigenvectors),
            lengths: eigen.eigenvalues.map(length),
        }
    }

    /// Returns a draw of this covariance, given standard normal numbers.
    fn color(&self, normal: &DVector<f64>) -> DVector<f64> {
        let scaled = normal.component_mul(&self.lengths);
        match &self.eigenvectors {
            Some(eigenvectors) => eigenvectors * scaled,
            None => scaled,
        }
    }

    /// Returns C^(-1/2) times a step, where C is the covariance.
    fn whiten(&self, step: &DVector<f64>) -> DVector<f64> {
        match &self.eigenvectors {
            Some(eigenvectors) => {
                eigenvectors * (eigenvectors.transpose() * step).component_div(&self.lengths)
            }
            None => step.component_div(&self.lengths),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// A valley a hundred times as long as wide, oblique to all three axes.
    fn valley(values: &Groups<Vec<f32>>) -> f32 {
        let [x, y] = values.initial[..] else {
            return f32::NAN;
        };
        let z = values.pattern[0];
        (x + y + z - 1.0).powi(2) * 1e4 + (x - y).powi(2) + (z - 2.0).powi(2)
    }

    fn evolution() -> Evolution {
        let origin = Groups {
            initial: vec![3.0, -2.0],
            hyperparameters: vec![7.0],
            pattern: vec![0.5],
            ..Groups::default()
        };
        let spreads = Groups {
            initial: 0.3,
            hyperparameters: 0.0,
            pattern: 0.1,
            ..Groups::default()
        };
        Evolution::new(origin, spreads)
    }

    fn run_generation(evolution: &mut Evolution, seed: u64) -> f32 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        evolution.advance(12, &mut random, |all| all.iter().map(valley).collect())
    }

    #[test]
    fn minimizes_narrow_valley_and_keeps_frozen_groups() {
        let mut evolution = evolution();
        for step in 0..300 {
            run_generation(&mut evolution, step);
        }
        let values = evolution.values();
        assert!(valley(&values) < 1e-6, "{values:?}");
        assert!((values.pattern[0] - 2.0).abs() < 1e-3, "{values:?}");
        assert_eq!(values.hyperparameters, [7.0]);
    }

    #[test]
    fn separable_evolution_learns_spread_per_axis() {
        // An axis-aligned ellipsoid. Its longest axis is ten times as long as its shortest one.
        let count = MAX_CORRELATED + 20;
        let ellipsoid = |values: &Groups<Vec<f32>>| -> f32 {
            let entries = values.pattern.iter().enumerate();
            let axis = |index: usize| 1.0 + 9.0 * index as f32 / (count - 1) as f32;
            entries
                .map(|(index, value)| (axis(index) * (value - 1.0)).powi(2))
                .sum()
        };
        let origin = Groups {
            pattern: vec![0.0; count],
            ..Groups::default()
        };
        let spreads = Groups {
            pattern: 0.3,
            ..Groups::default()
        };
        let mut evolution = Evolution::new(origin.clone(), spreads);
        for step in 0..1500 {
            let mut random = ChaCha8Rng::seed_from_u64(step);
            evolution.advance(24, &mut random, |all| all.iter().map(ellipsoid).collect());
        }
        let (before, after) = (ellipsoid(&origin), ellipsoid(&evolution.values()));
        assert!(after < 1e-6 * before, "{before} to {after}");
        let [first, .., last] = evolution.covariance[..] else {
            panic!("{evolution:?}");
        };
        assert!(
            (4.0..25.0).contains(&(first / last).sqrt()),
            "{first}, {last}"
        );
    }

    #[test]
    fn resumed_evolution_is_bit_identical() {
        let mut one = evolution();
        let mut other = evolution();
        for step in 0..40 {
            let bytes = postcard::to_stdvec(&other).unwrap();
            other = postcard::from_bytes(&bytes).unwrap();
            let [a, b] = [&mut one, &mut other].map(|evolution| run_generation(evolution, step));
            assert_eq!(a.to_bits(), b.to_bits());
        }
        assert_eq!(one, other);
    }

    #[test]
    fn nan_losses_rank_last() {
        let mut evolution = evolution();
        for step in 0..300 {
            let mut random = ChaCha8Rng::seed_from_u64(step);
            evolution.advance(12, &mut random, |all| {
                // A wall close to the origin: it hides about half of the first candidates.
                let losses = all.iter().map(|values| match values.initial[0] > 3.0 {
                    true => f32::NAN,
                    false => valley(values),
                });
                losses.collect()
            });
        }
        assert!(valley(&evolution.values()) < 1e-3);
    }
}
