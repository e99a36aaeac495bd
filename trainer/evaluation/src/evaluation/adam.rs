//! Adam (Kingma and Ba 2015) on a model's parameters: the methods Random and Optimum, and refinement of any fit.

use glimpse_core::model::Sample;
use glimpse_kernels::ModelKernels;
use glimpse_materials::Material;
use glimpse_materials::sampling::random_stream;
use glimpse_optimizer::{Groups, Optimizer};
use glimpse_training::initialization::{initial_guess, random_initialization};
use glimpse_training::tasks::samples::SampledMaterial;
use rand_chacha::ChaCha8Rng;

/// The learning rate of the method Random.
const RANDOM_RATE: f32 = 1e-3;
/// The number of fresh samples per step, for steps on fresh samples.
const FRESH_SAMPLES: usize = 512;
/// The number of steps of the method Optimum.
pub const OPTIMUM_STEPS: usize = 50_000;
/// The initial learning rate of the method Optimum.
const OPTIMUM_RATE: f32 = 2e-3;
/// The number of starts of the method Optimum. An output of a network may die early and never recover.
const OPTIMUM_STARTS: usize = 16;
/// Each start of the method Optimum is first tried with a fraction of the steps: all steps divided by this number. The
/// best one then takes all steps.
const OPTIMUM_TRIAL_DIVISOR: usize = 25;
/// The number of directions from which the method Optimum and refinement draw samples.
const POOL: usize = 65_536;

/// A model's parameters and burn's Adam optimizer. Only the group `initial` of the optimizer is used. It holds the
/// model's parameters.
struct Adam {
    kernels: &'static ModelKernels,
    optimizer: Optimizer,
}

/// Returns groups with the entry `initial` only.
fn initial<T: Default>(initial: T) -> Groups<T> {
    Groups {
        initial,
        ..Groups::default()
    }
}

impl Adam {
    fn new(kernels: &'static ModelKernels, start: Vec<f32>) -> Self {
        let optimizer = Optimizer::new(initial(start));
        Self { kernels, optimizer }
    }

    fn parameters(&self) -> &[f32] {
        &self.optimizer.values.initial
    }

    fn step(&mut self, gradient: Vec<f32>, rate: f32) {
        let rates = initial(f64::from(rate));
        self.optimizer.step(initial(gradient), &rates);
    }

    fn is_finite(&self) -> bool {
        self.parameters().iter().all(|value| value.is_finite())
    }

    /// Takes a step on samples that are drawn from a pool of one material.
    fn step_on_fresh_samples(
        &mut self,
        pool: &SampledMaterial,
        random: &mut ChaCha8Rng,
        rate: f32,
    ) {
        let draw = pool.draw(FRESH_SAMPLES, random);
        let mut gradient = vec![0.0; self.parameters().len()];
        (self.kernels.gradient)(self.parameters(), &draw.octets(), &mut gradient);
        self.step(gradient, rate);
    }
}

/// Runs the method Random: `steps` steps from a random start, each on all samples.
pub(super) fn random(
    kernels: &'static ModelKernels,
    samples: &[Sample<f32>],
    steps: usize,
    seed: u64,
) -> Vec<f32> {
    let start = random_initialization(kernels.model, &mut random_stream(seed, 1));
    let mut adam = Adam::new(kernels, start);
    for _ in 0..steps {
        let mut gradient = vec![0.0; adam.parameters().len()];
        (kernels.gradient_by_sample)(adam.parameters(), samples, &mut gradient);
        adam.step(gradient, RANDOM_RATE);
    }
    adam.optimizer.values.initial
}

/// Refines a fit by `steps` steps, each on 512 fresh samples (paper, "Convergence").
pub(super) fn refine(
    kernels: &'static ModelKernels,
    fitted: Vec<f32>,
    material: &dyn Material,
    steps: usize,
    seed: u64,
) -> Vec<f32> {
    let pool = SampledMaterial::new(material, POOL, seed);
    let mut random = random_stream(seed, 4);
    let mut adam = Adam::new(kernels, fitted);
    for _ in 0..steps {
        adam.step_on_fresh_samples(&pool, &mut random, RANDOM_RATE);
    }
    adam.optimizer.values.initial
}

/// Runs the method Optimum: an estimate of the model's best fit. It takes very many steps, each on fresh samples, with
/// a learning rate that decays to 0, from the best of several starts. Returns None if it diverges.
pub(super) fn optimum(
    kernels: &'static ModelKernels,
    material: &dyn Material,
    steps: usize,
    seed: u64,
) -> Option<Vec<f32>> {
    let pool = SampledMaterial::new(material, POOL, seed);
    let [mut random, mut starts] = [2, 3].map(|stream| random_stream(seed, stream));
    let mut descend = |adam: &mut Adam, steps: usize| {
        for step in 0..steps {
            let done = step as f32 / steps as f32;
            let rate = 0.5 * OPTIMUM_RATE * (1.0 + (std::f32::consts::PI * done).cos());
            adam.step_on_fresh_samples(&pool, &mut random, rate);
        }
        (kernels.loss)(adam.parameters(), &pool.all().octets())
    };
    let starts = (0..OPTIMUM_STARTS).map(|_| {
        let mut adam = Adam::new(kernels, initial_guess(kernels.model, &mut starts));
        (descend(&mut adam, steps / OPTIMUM_TRIAL_DIVISOR), adam)
    });
    let mut adam = least_loss(starts)?;
    descend(&mut adam, steps);
    adam.is_finite().then_some(adam.optimizer.values.initial)
}

/// Returns the start with the least loss; None if all diverged. The loss of parameters that are not finite may be finite.
fn least_loss(starts: impl Iterator<Item = (f32, Adam)>) -> Option<Adam> {
    let finite = starts.filter(|(loss, adam)| loss.is_finite() && adam.is_finite());
    let best = finite.min_by(|(one, _), (other, _)| one.total_cmp(other));
    best.map(|(_, adam)| adam)
}

#[cfg(test)]
mod tests {
    use glimpse_core::model::ModelKind;

    use super::*;

    #[test]
    fn diverged_starts_are_not_chosen() {
        let start = |(loss, value): (f32, f32)| {
            let kernels = ModelKernels::of(ModelKind::Phong).expect("kernels");
            (loss, Adam::new(kernels, vec![value; 7]))
        };
        let diverged = [(f32::NAN, 1.0), (0.1, f32::NAN), (f32::INFINITY, 2.0)];
        assert!(least_loss(diverged.into_iter().map(start)).is_none());
        let starts = diverged.into_iter().chain([(3.0, 3.0), (2.0, 4.0)]);
        let best = least_loss(starts.map(start)).map(|adam| adam.optimizer.values.initial);
        assert_eq!(best, Some(vec![4.0; 7]));
    }
}
