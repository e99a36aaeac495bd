//! Evolution of the covariance matrix (CMA-ES; Hansen, "The CMA Evolution Strategy: A Tutorial").
//!
//! The log loss of a fit knows of a measured value only on which side of the model's it is, and
//! where a sample changes sides the fit's gradient jumps. Exact gradients see the slopes between
//! the jumps, and nothing of the jumps; for the models of a few parameters, where eight samples
//! make many jumps and few slopes, that is the smaller part. Evolution looks at the loss itself:
//! it draws candidates about a mean and moves mean, spread and correlations towards the better
//! half. It needs many evaluations, each of some 10 us a material. Of many meta-parameters it learns
//! spreads only and no correlations (separable CMA-ES; Ros and Hansen 2008), which is less to learn.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::start::standard_normal;
use glimpse_optimizer::Groups;

/// An evolution as it stands. The groups' entries are in units of their first spread.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    /// The values of all groups where it began; frozen ones stay so.
    origin: Groups<Vec<f32>>,
    /// The first standard deviation of each group; 0 freezes it.
    spreads: Groups<f64>,
    /// The mean, as an offset from the origin.
    mean: Vec<f64>,
    /// The step size sigma.
    sigma: f64,
    /// The covariance matrix, column by column; its diagonal alone if it is separable.
    covariance: Vec<f64>,
    /// The evolution path of the covariance, and the one of sigma.
    path: Vec<f64>,
    sigma_path: Vec<f64>,
    generation: i32,
}

/// The strategy's constants; the names are the tutorial's.
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

/// Most meta-parameters whose correlations are learned too.
const CORRELATED: usize = 128;

impl Constants {
    fn new(dimensions: usize, population: usize) -> Self {
        let n = dimensions as f64;
        let mu = population / 2;
        let logarithms = (1..=mu).map(|i| (mu as f64 + 0.5).ln() - (i as f64).ln());
        let sum: f64 = logarithms.clone().sum();
        let weights: Vec<f64> = logarithms.map(|weight| weight / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        // A diagonal is learned faster.
        let faster = match dimensions > CORRELATED {
            true => (n + 2.0) / 3.0,
            false => 1.0,
        };
        let c_1 = (faster * 2.0 / ((n + 1.3).powi(2) + mu_eff)).min(1.0);
        let c_mu = faster * 2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0).powi(2) + mu_eff);
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
    /// Begins about some values, each group spread by a standard deviation.
    #[must_use]
    pub fn new(origin: Groups<Vec<f32>>, spreads: Groups<f64>) -> Self {
        let free = |(values, spread): (&Vec<f32>, &f64)| match *spread > 0.0 {
            true => values.len(),
            false => 0,
        };
        let dimensions = origin
            .each()
            .into_iter()
            .zip(spreads.each())
            .map(free)
            .sum();
        Self {
            mean: vec![0.0; dimensions],
            sigma: 1.0,
            covariance: match dimensions > CORRELATED {
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

    /// The meta-parameters at the mean.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        self.at(&self.mean)
    }

    fn at(&self, offset: &[f64]) -> Groups<Vec<f32>> {
        let mut values = self.origin.clone();
        let mut rest = offset;
        for (group, spread) in values.each_mut().into_iter().zip(self.spreads.each()) {
            if *spread > 0.0 {
                let (run, after) = rest.split_at(group.len());
                for (value, offset) in group.iter_mut().zip(run) {
                    *value = (f64::from(*value) + spread * offset) as f32;
                }
                rest = after;
            }
        }
        values
    }

    /// One generation: draws candidates, asks for the losses of all of them, and moves on. Returns
    /// the least loss.
    pub fn advance(
        &mut self,
        population: usize,
        random: &mut ChaCha8Rng,
        losses: impl FnOnce(&[Groups<Vec<f32>>]) -> Vec<f32>,
    ) -> f32 {
        let constants = Constants::new(self.mean.len(), population);
        let root = Root::new(self.mean.len(), &self.covariance);
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
        let chosen: Vec<(f64, &DVector<f64>)> = order
            .iter()
            .zip(&constants.weights)
            .map(|(index, weight)| (*weight, &steps[*index]))
            .collect();
        self.learn(&constants, &root, &chosen);
        order.first().map_or(f32::NAN, loss)
    }

    /// Steps from the mean, in units of sigma.
    fn draw(&self, root: &Root, population: usize, random: &mut ChaCha8Rng) -> Vec<DVector<f64>> {
        let dimensions = self.mean.len();
        (0..population)
            .map(|_| {
                let normal =
                    DVector::from_fn(dimensions, |_, _| f64::from(standard_normal(random)));
                root.color(&normal)
            })
            .collect()
    }

    /// The meta-parameters a step from the mean.
    fn candidate(&self, step: &DVector<f64>) -> Groups<Vec<f32>> {
        let entries = self.mean.iter().zip(step.iter());
        let offset: Vec<f64> = entries.map(|(mean, y)| mean + self.sigma * y).collect();
        self.at(&offset)
    }

    /// Moves mean, paths, covariance and sigma by the steps of the better half, each with its weight.
    fn learn(&mut self, constants: &Constants, root: &Root, chosen: &[(f64, &DVector<f64>)]) {
        let n = self.mean.len();
        let mut step = DVector::zeros(n);
        for (weight, y) in chosen {
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
        let settled = (1.0 - (1.0 - c_sigma).powi(2 * self.generation)).sqrt();
        let length = sigma_path.norm();
        let stall = length / settled / chi >= 1.4 + 2.0 / (n as f64 + 1.0);
        let moving = if stall { 0.0 } else { 1.0 };
        let mut path = DVector::from_column_slice(&self.path);
        path.axpy(
            moving * (c_c * (2.0 - c_c) * mu_eff).sqrt(),
            &step,
            1.0 - c_c,
        );
        self.learn_covariance(constants, moving, &path, chosen);
        self.sigma *= ((c_sigma / damping) * (length / chi - 1.0)).exp();
        self.path = path.as_slice().to_vec();
        self.sigma_path = sigma_path.as_slice().to_vec();
    }

    /// The covariance keeps a share of itself, and gains those of its path and of the chosen steps.
    fn learn_covariance(
        &mut self,
        constants: &Constants,
        moving: f64,
        path: &DVector<f64>,
        chosen: &[(f64, &DVector<f64>)],
    ) {
        let Constants { c_c, c_1, c_mu, .. } = *constants;
        let n = self.mean.len();
        let kept = 1.0 - c_1 - c_mu + c_1 * (1.0 - moving) * c_c * (2.0 - c_c);
        let drawn = chosen.iter().map(|(weight, y)| (c_mu * weight, *y));
        let outer_products = [(c_1, path)].into_iter().chain(drawn);
        if self.covariance.len() == n {
            for (row, variance) in self.covariance.iter_mut().enumerate() {
                let added = outer_products
                    .clone()
                    .map(|(share, y)| share * y[row] * y[row]);
                *variance = kept * *variance + added.sum::<f64>();
            }
        } else {
            let mut covariance = DMatrix::from_column_slice(n, n, &self.covariance);
            covariance *= kept;
            for (share, y) in outer_products {
                covariance.ger(share, y, y, 1.0);
            }
            self.covariance = covariance.as_slice().to_vec();
        }
    }
}

/// The symmetric root of the covariance matrix. It is computed from what is saved, so that a resumed
/// evolution draws the same.
struct Root {
    /// Columns; None if the matrix is a diagonal.
    eigenvectors: Option<DMatrix<f64>>,
    lengths: DVector<f64>,
}

impl Root {
    fn new(n: usize, covariance: &[f64]) -> Self {
        let length = |variance: f64| variance.max(1e-20).sqrt();
        if covariance.len() == n {
            return Self {
                eigenvectors: None,
                lengths: DVector::from_column_slice(covariance).map(length),
            };
        }
        let found = SymmetricEigen::new(DMatrix::from_column_slice(n, n, covariance));
        Self {
            eigenvectors: Some(found.eigenvectors),
            lengths: found.eigenvalues.map(length),
        }
    }

    /// A draw of this covariance from one of standard normal numbers.
    fn color(&self, normal: &DVector<f64>) -> DVector<f64> {
        let long = normal.component_mul(&self.lengths);
        match &self.eigenvectors {
            Some(eigenvectors) => eigenvectors * long,
            None => long,
        }
    }

    /// The other way round.
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

    /// A valley a hundred times as long as it is wide, across all three axes.
    fn valley(values: &Groups<Vec<f32>>) -> f32 {
        let [x, y] = values.initial[..] else {
            return f32::NAN;
        };
        let z = values.pattern[0];
        (x + y + z - 1.0).powi(2) * 1e4 + (x - y).powi(2) + (z - 2.0).powi(2)
    }

    fn begin() -> Evolution {
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

    fn generation(evolution: &mut Evolution, step: u64) -> f32 {
        let mut random = ChaCha8Rng::seed_from_u64(step);
        evolution.advance(12, &mut random, |all| all.iter().map(valley).collect())
    }

    #[test]
    fn it_finds_the_end_of_a_narrow_valley_and_leaves_frozen_groups_alone() {
        let mut evolution = begin();
        for step in 0..300 {
            generation(&mut evolution, step);
        }
        let values = evolution.values();
        assert!(valley(&values) < 1e-6, "{values:?}");
        assert!((values.pattern[0] - 2.0).abs() < 1e-3, "{values:?}");
        assert_eq!(values.hyperparameters, [7.0]);
    }

    #[test]
    fn many_meta_parameters_have_spreads_of_their_own() {
        // An ellipsoid along the axes, the longest of them ten times the shortest.
        let count = CORRELATED + 20;
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
    fn it_goes_on_from_what_is_saved_bit_for_bit() {
        let mut one = begin();
        let mut other = begin();
        for step in 0..40 {
            let bytes = postcard::to_stdvec(&other).unwrap();
            other = postcard::from_bytes(&bytes).unwrap();
            let [a, b] = [&mut one, &mut other].map(|evolution| generation(evolution, step));
            assert_eq!(a.to_bits(), b.to_bits());
        }
        assert_eq!(one, other);
    }

    #[test]
    fn losses_that_are_no_numbers_are_the_worst() {
        let mut evolution = begin();
        for step in 0..300 {
            let mut random = ChaCha8Rng::seed_from_u64(step);
            evolution.advance(12, &mut random, |all| {
                // A wall beside the beginning: about half of the first candidates are behind it.
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
