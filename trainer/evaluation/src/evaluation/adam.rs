//! Adam (Kingma and Ba 2015) on a model's parameters: the methods Random and Optimum, and refinement of any fit.

use glimpse_core::model::{Model, ParameterSet, Sample};
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::unflatten;
use glimpse_materials::Material;
use glimpse_optimizer::{Groups, Optimizer};
use glimpse_training::meta::initialization::{initial_guess, random_initialization};
use glimpse_training::meta::samples::SampledMaterial;
use rand::SeedableRng;
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
struct Adam<M: Model> {
    parameters: M::Parameters<f32>,
    optimizer: Optimizer,
}

impl<M: Model> Adam<M> {
    fn new(start: &[f32]) -> Self {
        let mut parameters = M::Parameters::filled(0.0);
        unflatten(start, &mut parameters);
        let initial = parameters.iter().copied().collect();
        Self {
            parameters,
            optimizer: Optimizer::new(Groups {
                initial,
                ..Groups::default()
            }),
        }
    }

    fn step(&mut self, gradient: &M::Parameters<f32>, rate: f32) {
        let gradients = Groups {
            initial: gradient.iter().copied().collect(),
            ..Groups::default()
        };
        let rates = Groups {
            initial: f64::from(rate),
            ..Groups::default()
        };
        self.optimizer.step(gradients, &rates);
        let values = self.optimizer.values();
        unflatten(&values.initial, &mut self.parameters);
    }

    fn into_list(self) -> Vec<f32> {
        self.parameters.iter().copied().collect()
    }
}

impl<M: LaneModel> Adam<M> {
    /// Takes a step on samples that are drawn from a pool of one material.
    fn step_on_fresh_samples(
        &mut self,
        pool: &SampledMaterial,
        random: &mut ChaCha8Rng,
        rate: f32,
    ) {
        let draw = pool.draw(FRESH_SAMPLES, random);
        let mut gradient = M::Parameters::filled(0.0);
        M::gradient(&self.parameters, &draw.octets(), &mut gradient);
        self.step(&gradient, rate);
    }
}

/// Runs the method Random: `steps` steps from a random start, each on all samples.
pub(super) fn random<M: Model>(samples: &[Sample<f32>], steps: usize, seed: u64) -> Vec<f32> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(1);
    let mut adam = Adam::<M>::new(&random_initialization(M::KIND, &mut random));
    for _ in 0..steps {
        let mut gradient = M::Parameters::filled(0.0);
        for sample in samples {
            M::accumulate_gradient::<f32, false>(&adam.parameters, sample, &mut gradient);
        }
        adam.step(&gradient, RANDOM_RATE);
    }
    adam.into_list()
}

/// Refines a fit by `steps` steps, each on 512 fresh samples (paper, "Convergence").
pub(super) fn refine<M: LaneModel>(
    fitted: &[f32],
    material: &dyn Material,
    steps: usize,
    seed: u64,
) -> Vec<f32> {
    let pool = SampledMaterial::new(material, POOL, seed);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(4);
    let mut adam = Adam::<M>::new(fitted);
    for _ in 0..steps {
        adam.step_on_fresh_samples(&pool, &mut random, RANDOM_RATE);
    }
    adam.into_list()
}

/// Runs the method Optimum: an estimate of the model's best fit. It takes very many steps, each on fresh samples, with
/// a learning rate that decays to 0, from the best of several starts.
pub(super) fn optimum<M: LaneModel>(material: &dyn Material, steps: usize, seed: u64) -> Vec<f32> {
    let pool = SampledMaterial::new(material, POOL, seed);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(2);
    let mut starts = random.clone();
    starts.set_stream(3);
    let mut descend = |adam: &mut Adam<M>, steps: usize| {
        for step in 0..steps {
            let done = step as f32 / steps as f32;
            let rate = 0.5 * OPTIMUM_RATE * (1.0 + (std::f32::consts::PI * done).cos());
            adam.step_on_fresh_samples(&pool, &mut random, rate);
        }
        M::loss(&adam.parameters, &pool.all().octets())
    };
    let mut best = (f32::INFINITY, Adam::<M>::new(&[]));
    for _ in 0..OPTIMUM_STARTS {
        let mut adam = Adam::<M>::new(&initial_guess(M::KIND, &mut starts));
        let loss = descend(&mut adam, steps / OPTIMUM_TRIAL_DIVISOR);
        if loss < best.0 {
            best = (loss, adam);
        }
    }
    let (_, mut adam) = best;
    descend(&mut adam, steps);
    adam.into_list()
}
