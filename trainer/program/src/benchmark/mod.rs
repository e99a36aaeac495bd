//! Benchmarks of the work that dominates meta-learning: the meta-gradient of one task, which is the unrolled inner loop
//! with its exact adjoint. Throughput is compared with the machine's peak, which the same run measures with [`peak()`].

mod neural;

use std::time::Instant;

use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient};
use glimpse_materials::sampling::sobol_valid;
use glimpse_materials::{Material, Procedural};
use glimpse_training::meta::initialization::initial_guess;
use glimpse_training::meta::pattern::Pattern;
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::meta::samples::{SampledMaterial, WeightedSamples};
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
        let mut items: Vec<Item<'_>> = self.items_of::<Neural>().into();
        items.extend(self.items_of::<Phong>());
        items.extend(self.items_of::<CookTorrance>());
        items.retain(|item| model.is_none_or(|model| item.model == model));
        items
    }

    fn items_of<'a, M: LaneModel + 'a>(&'a self) -> [Item<'a>; 3] {
        let item = |work, is_parallel, multiply_accumulates, run| Item {
            model: M::KIND,
            work,
            is_parallel,
            multiply_accumulates: Some(multiply_accumulates)
                .filter(|_| M::KIND == ModelKind::Neural),
            run,
        };
        [
            item(
                "20 steps of 512 fresh samples, outer 512",
                true,
                neural::outer_step(512, 512, false),
                self.fresh_samples_run::<M>(512, 512),
            ),
            item(
                "20 steps of a pattern of 8, outer 512",
                false,
                neural::outer_step(PATTERN_SIZE, 512, true),
                self.pattern_run::<M>(512),
            ),
            item(
                "20 steps of a pattern of 8, outer 25,000",
                true,
                neural::outer_step(PATTERN_SIZE, 25_000, true),
                self.pattern_run::<M>(25_000),
            ),
        ]
    }

    /// Returns one run of the paper's first stage: fresh samples at every step.
    fn fresh_samples_run<'a, M: LaneModel + 'a>(
        &'a self,
        inner: usize,
        outer: usize,
    ) -> Box<dyn FnMut() + 'a> {
        let inner_loop = untrained_inner_loop::<M>();
        let mut generator = generator();
        let mut draw = |count| self.pool.draw(count, &mut generator);
        let draws: Vec<_> = (0..inner_loop.steps).map(|_| draw(inner)).collect();
        let outer = draw(outer);
        let mut gradient = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let lists: Vec<_> = draws.iter().map(|draw| draw.octets()).collect();
            M::meta_gradient(&mut gradient, &inner_loop, &lists, &outer.octets(), None);
        })
    }

    /// Returns one run of the paper's second stage: the pattern's samples at every step, and the gradient with respect
    /// to the pattern.
    fn pattern_run<'a, M: LaneModel + 'a>(&'a self, outer: usize) -> Box<dyn FnMut() + 'a> {
        let inner_loop = untrained_inner_loop::<M>();
        let outer = self.pool.draw(outer, &mut generator());
        let pattern = &self.pattern;
        let brdf = pattern
            .angles()
            .iter()
            .map(|at| self.material.at_angles(*at));
        let brdf: Vec<[f32; 3]> = brdf.collect();
        let measured = WeightedSamples::present(pattern.octet_directions(), &brdf, pattern.valid());
        let mut gradient = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let inner = measured.octets();
            let mut derivatives = inner.zero_derivatives();
            let outer = outer.octets();
            M::meta_gradient(
                &mut gradient,
                &inner_loop,
                &[inner],
                &outer,
                Some(&mut derivatives),
            );
            std::hint::black_box(
                pattern.gradient_by_logits(|index| pattern.gradient_by_angles(&derivatives, index)),
            );
        })
    }
}

/// Returns an inner loop with untrained initial parameters and step sizes.
fn untrained_inner_loop<M: LaneModel>() -> InnerLoop<M, f32> {
    let initial = initial_guess(M::KIND, &mut generator());
    let step_sizes = vec![1e-3; initial.len()];
    InnerLoop::new(&initial, &step_sizes, INNER_STEPS)
}

/// Returns a generator of random numbers in its initial state.
fn generator() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(SEED)
}
