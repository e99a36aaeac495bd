//! Benchmark of the work that dominates meta-learning: the meta-gradient of one task, which is the unrolled inner loop
//! with its exact adjoint. Throughput is compared with the machine's peak, which the same run measures.

use std::hint::black_box;
use std::time::Instant;

use glimpse_core::model::ModelKind;
use glimpse_kernels::ModelKernels;
use glimpse_kernels::inner_loop::InnerLoop;
use glimpse_materials::sampling::sobol_valid;
use glimpse_materials::{Brdf, Procedural, rows};
use glimpse_training::initialization::initial_guess;
use glimpse_training::pattern::{Reach, SamplePattern};
use glimpse_training::run::INNER_STEPS;
use glimpse_training::tasks::samples::{SampledMaterial, WeightedSamples};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

/// The number of directions at which the material is evaluated.
const POOL_SIZE: usize = 32_768;
/// The number of samples of the pattern.
const PATTERN_SIZE: usize = 8;
/// The number of fresh samples of an inner step.
const FRESH_SIZE: usize = 512;
/// The seed of all random numbers. It is fixed, so that runs are comparable.
const SEED: u64 = 1;
/// The minimum number of runs of a work.
const MIN_RUNS: usize = 5;

/// The meta-gradient of one task.
#[derive(Deserialize)]
pub(crate) struct Work {
    /// The samples of the inner loop and of the outer loss.
    pub(crate) name: String,
    /// True for the paper's second stage: the pattern's samples at every step, and the gradient with respect to the
    /// pattern. Otherwise fresh samples at every step.
    is_pattern: bool,
    /// The number of samples of the outer loss.
    outer: usize,
    /// True if one run uses all threads of the thread pool. Others are too short to distribute.
    pub(crate) is_parallel: bool,
}

/// Returns all works.
pub(crate) fn works() -> Vec<Work> {
    rows(include_str!("works.csv"))
}

impl Work {
    /// Returns the median time of a run in seconds, of runs for `seconds` after a warm-up of a tenth of it.
    ///
    /// Run it on a thread of the thread pool, inside [`rayon::scope`]. From any other thread, each transfer to the pool
    /// takes about 10 us.
    pub(crate) fn measure(&self, kernels: &ModelKernels, seconds: f64) -> f64 {
        let mut generator = ChaCha8Rng::seed_from_u64(SEED);
        let initial = initial_guess(kernels.model, &mut generator);
        let step_sizes = vec![1e-3; initial.len()];
        let material = Procedural::set(1, SEED).remove(0);
        let pool = SampledMaterial::new(&material, POOL_SIZE, SEED);
        let pattern = SamplePattern::new(&Reach::ANY, sobol_valid(PATTERN_SIZE, SEED as u32));
        let samples = if self.is_pattern {
            let brdf = pattern.angles.iter().map(|at| material.at_angles(*at));
            let brdf: Vec<[f32; 3]> = brdf.collect();
            let directions = &pattern.octet_directions;
            vec![WeightedSamples::present(directions, &brdf, &pattern.valid)]
        } else {
            let draws = (0..INNER_STEPS).map(|_| pool.draw(FRESH_SIZE, &mut generator));
            draws.collect()
        };
        let outer = pool.draw(self.outer, &mut generator);
        let run =
            || {
                let inner = InnerLoop {
                    initial: &initial[..],
                    step_sizes: &step_sizes,
                    steps: INNER_STEPS,
                };
                let lists: Vec<_> = samples.iter().map(WeightedSamples::octets).collect();
                let mut derivatives = self.is_pattern.then(|| lists[0].zero_derivatives());
                let outer = &outer.octets();
                (kernels.meta_gradient)(&inner, &lists, outer, derivatives.as_deref_mut());
                if let Some(derivatives) = derivatives {
                    black_box(pattern.gradient_by_logits(|index| {
                        pattern.gradient_by_angles(&derivatives, index)
                    }));
                }
            };
        run_times(0.1 * seconds, run);
        let mut times = run_times(seconds, run);
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// Returns the number of multiply-accumulates of all matrix products in one run: a gradient in the forward pass
    /// and a product of Hessian and vector in the reverse pass of every inner step, and a gradient over the outer
    /// samples. None for the small models, which mostly compute exponentials and divisions.
    ///
    /// At one sample, a pass forward takes each weight once. A pass backward does not need the first layer, but for
    /// derivatives with respect to the sample. The gradient with respect to the weights takes each of them once more.
    /// With dual numbers, passes count three times (value times value, tangent times value, and value times tangent),
    /// and the gradient, which only needs the tangent, twice.
    pub(crate) fn multiply_accumulates(&self, model: ModelKind) -> Option<u64> {
        // The input hy is always 0, so its row is not computed.
        const FIRST_LAYER: u64 = 5 * 21;
        const OTHER_LAYERS: u64 = 21 * 21 + 21 * 3;
        const ALL_LAYERS: u64 = FIRST_LAYER + OTHER_LAYERS;
        let gradient = 2 * ALL_LAYERS + OTHER_LAYERS;
        let (inner, backward) = if self.is_pattern {
            (PATTERN_SIZE, ALL_LAYERS)
        } else {
            (FRESH_SIZE, OTHER_LAYERS)
        };
        let product = 5 * ALL_LAYERS + 3 * backward;
        let count = (INNER_STEPS * inner) as u64 * (gradient + product);
        (model == ModelKind::Neural).then_some(count + self.outer as u64 * gradient)
    }
}

/// Runs for `seconds` seconds and at least [`MIN_RUNS`] times. Returns the time of each run, in seconds.
fn run_times(seconds: f64, run: impl Fn()) -> Vec<f64> {
    let mut times = Vec::new();
    let begin = Instant::now();
    while times.len() < MIN_RUNS || begin.elapsed().as_secs_f64() < seconds {
        let run_begin = Instant::now();
        run();
        times.push(run_begin.elapsed().as_secs_f64());
    }
    times
}
