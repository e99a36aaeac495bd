//! Benchmarks of the work that dominates meta-learning: the meta-gradient of one task, which is the unrolled inner loop
//! with its exact adjoint. Throughput is compared with the machine's peak, which the same run measures with [`peak()`].

mod neural;

use std::time::Instant;

use glimpse_core::model::ModelKind;
use glimpse_kernels::ModelKernels;
use glimpse_kernels::inner_loop::InnerLoop;
use glimpse_materials::sampling::sobol_valid;
use glimpse_materials::{Material, Procedural};
use glimpse_training::initialization::initial_guess;
use glimpse_training::pattern::Pattern;
use glimpse_training::run::INNER_STEPS;
use glimpse_training::tasks::samples::{SampledMaterial, WeightedSamples};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use glimpse_kernels::peak::peak;

/// The number of directions at which the material is evaluated.
const POOL_SIZE: usize = 32_768;
/// The number of samples of the pattern.
const PATTERN_SIZE: usize = 8;
/// The seed of all random numbers. It is fixed, so that runs are comparable.
const SEED: u64 = 1;
/// The minimum number of runs of an item.
const MIN_RUNS: usize = 5;

/// A benchmark item: the meta-gradient of one task.
pub struct Item<'a> {
    /// The model.
    pub model: ModelKind,
    /// The samples of the inner loop and of the outer loss.
    pub work: &'static str,
    /// True if one run uses all threads of the thread pool. Others are too short to distribute.
    pub is_parallel: bool,
    /// The number of multiply-accumulates of all matrix products in one run; None for the small models, which mostly
    /// compute exponentials and divisions.
    pub multiply_accumulates: Option<u64>,
    run: Box<dyn FnMut() + 'a>,
}

impl Item<'_> {
    /// Returns the median time of a run in seconds, after a warm-up of a tenth of `seconds`.
    pub fn measure(&mut self, seconds: f64) -> f64 {
        self.run_times(0.1 * seconds);
        let mut times = self.run_times(seconds);
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }

    /// Runs for `seconds` seconds and at least [`MIN_RUNS`] times. Returns the time of each run, in seconds.
    fn run_times(&mut self, seconds: f64) -> Vec<f64> {
        let mut times = Vec::new();
        let begin = Instant::now();
        while times.len() < MIN_RUNS || begin.elapsed().as_secs_f64() < seconds {
            let run_begin = Instant::now();
            (self.run)();
            times.push(run_begin.elapsed().as_secs_f64());
        }
        times
    }
}

/// The shared data of all items: a material, its values at many directions, and a pattern.
pub struct Workload {
    material: Box<dyn Material>,
    pool: SampledMaterial,
    pattern: Pattern,
}

impl Default for Workload {
    fn default() -> Self {
        let material = Procedural::set(1, SEED).remove(0);
        Self {
            pool: SampledMaterial::new(&material, POOL_SIZE, SEED),
            material: Box::new(material),
            pattern: Pattern::new(sobol_valid(PATTERN_SIZE, SEED as u32)),
        }
    }
}

impl Workload {
    /// Returns the items of one model, or all items if `model` is None.
    ///
    /// Run them on a thread of the thread pool, inside [`rayon::scope`]. From any other thread, each transfer to the
    /// pool takes about 10 us.
    #[must_use]
    pub fn items(&self, model: Option<ModelKind>) -> Vec<Item<'_>> {
        [ModelKind::Neural, ModelKind::Phong, ModelKind::CookTorrance]
            .into_iter()
            .filter(|each| model.is_none_or(|model| model == *each))
            .filter_map(ModelKernels::of)
            .flat_map(|kernels| self.items_of(kernels))
            .collect()
    }

    fn items_of(&self, kernels: &'static ModelKernels) -> [Item<'_>; 3] {
        let item = |work, is_parallel, multiply_accumulates, run| Item {
            model: kernels.model,
            work,
            is_parallel,
            multiply_accumulates: (kernels.model == ModelKind::Neural)
                .then_some(multiply_accumulates),
            run,
        };
        [
            item(
                "20 steps of 512 fresh samples, outer 512",
                true,
                neural::outer_step(512, 512, false),
                self.fresh_samples_run(kernels, 512, 512),
            ),
            item(
                "20 steps of a pattern of 8, outer 512",
                false,
                neural::outer_step(PATTERN_SIZE, 512, true),
                self.pattern_run(kernels, 512),
            ),
            item(
                "20 steps of a pattern of 8, outer 25,000",
                true,
                neural::outer_step(PATTERN_SIZE, 25_000, true),
                self.pattern_run(kernels, 25_000),
            ),
        ]
    }

    /// Returns one run of the paper's first stage: fresh samples at every step.
    fn fresh_samples_run(
        &self,
        kernels: &'static ModelKernels,
        inner: usize,
        outer: usize,
    ) -> Box<dyn FnMut() + '_> {
        let untrained = untrained(kernels.model);
        let mut generator = generator();
        let mut draw = |count| self.pool.draw(count, &mut generator);
        let draws: Vec<_> = (0..INNER_STEPS).map(|_| draw(inner)).collect();
        let outer = draw(outer);
        Box::new(move || {
            let lists: Vec<_> = draws.iter().map(|draw| draw.octets()).collect();
            (kernels.meta_gradient)(&inner_loop(&untrained), &lists, &outer.octets(), None);
        })
    }

    /// Returns one run of the paper's second stage: the pattern's samples at every step, and the gradient with respect
    /// to the pattern.
    fn pattern_run(&self, kernels: &'static ModelKernels, outer: usize) -> Box<dyn FnMut() + '_> {
        let untrained = untrained(kernels.model);
        let outer = self.pool.draw(outer, &mut generator());
        let pattern = &self.pattern;
        let brdf = pattern
            .angles()
            .iter()
            .map(|at| self.material.at_angles(*at));
        let brdf: Vec<[f32; 3]> = brdf.collect();
        let measured = WeightedSamples::present(pattern.octet_directions(), &brdf, pattern.valid());
        Box::new(move || {
            let inner = measured.octets();
            let mut derivatives = inner.zero_derivatives();
            (kernels.meta_gradient)(
                &inner_loop(&untrained),
                &[inner],
                &outer.octets(),
                Some(&mut derivatives),
            );
            std::hint::black_box(
                pattern.gradient_by_logits(|index| pattern.gradient_by_angles(&derivatives, index)),
            );
        })
    }
}

/// Returns untrained initial parameters and step sizes.
fn untrained(model: ModelKind) -> [Vec<f32>; 2] {
    let initial = initial_guess(model, &mut generator());
    let step_sizes = vec![1e-3; initial.len()];
    [initial, step_sizes]
}

fn inner_loop([initial, step_sizes]: &[Vec<f32>; 2]) -> InnerLoop<'_, f32> {
    InnerLoop {
        initial,
        step_sizes,
        steps: INNER_STEPS,
    }
}

/// Returns a generator of random numbers in its initial state.
fn generator() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(SEED)
}
