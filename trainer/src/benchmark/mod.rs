//! Benchmarks of the work that dominates meta-learning. `trainer bench` prints the times.
//!
//! An item is one of these:
//! - the meta-gradient of one task: the unrolled inner loop with its exact adjoint, as in training;
//! - a kernel within it;
//! - a whole training step over a batch of tasks.
//!
//! Throughput is compared with the machine's peak, which the same run measures with [`peak()`].

mod neural;
mod peak;
mod timing;

use std::marker::PhantomData;

use glimpse_core::model::{CookTorrance, ModelKind, Neural, ParameterSet, Phong};
use glimpse_kernels::Dual;
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::{InnerLoop, MetaGradient};
use glimpse_materials::sampling::sobol_valid;
use glimpse_materials::{Material, Procedural};
use glimpse_optimizer::{Groups, Optimizer};
use glimpse_training::meta::descent::{DescentObjective, TaskSet};
use glimpse_training::meta::initialization::initial_guess;
use glimpse_training::meta::objective::{MetaObjective, RandomStreams};
use glimpse_training::meta::pattern::{Pattern, logits_from_angles};
use glimpse_training::meta::phase::{InnerSamples, OuterStep, Phase, SearchMethod};
use glimpse_training::meta::plan::{Effort, Plan, Schedule};
use glimpse_training::meta::pool::Pool;
use glimpse_training::meta::run::INNER_STEPS;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use peak::{Peak, peak};
pub use timing::{Timing, measure};

/// The number of procedural materials.
const MATERIALS: usize = 32;
/// The number of directions at which each material is evaluated.
const POOL_SIZE: usize = 32_768;
/// The number of samples of the pattern.
const PATTERN_SIZE: usize = 8;
/// The seed of all random numbers. It is fixed, so that runs are comparable.
const SEED: u64 = 1;

/// The number of threads of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Threads {
    /// One thread, for items that are too short to distribute.
    One,
    /// All threads of the thread pool.
    All,
}

impl Threads {
    /// Returns the number of threads.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::All => rayon::current_num_threads(),
        }
    }
}

/// A benchmark item.
pub struct Item<'a> {
    /// The model.
    pub model: ModelKind,
    /// The name of the work, without the model.
    pub work: &'static str,
    /// The number of threads.
    pub threads: Threads,
    /// The number of tasks in one run.
    pub tasks: usize,
    /// The number of multiply-accumulates of all matrix products in one run; None for the small models, which mostly
    /// compute exponentials and divisions.
    pub multiply_accumulates: Option<u64>,
    run: Box<dyn FnMut() + 'a>,
}

impl Item<'_> {
    /// Returns the names of the model and the work.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}: {}", self.model, self.work)
    }

    /// Runs the item once.
    pub fn run(&mut self) {
        (self.run)();
    }
}

/// Creates the materials of all items.
#[must_use]
pub fn materials() -> Vec<Box<dyn Material>> {
    Procedural::set(MATERIALS, SEED)
        .into_iter()
        .map(|material| Box::new(material) as _)
        .collect()
}

/// The shared data of all items: materials, directions, pattern and training plans.
pub struct Workload<'m> {
    tasks: TaskSet<'m>,
    pattern: Pattern,
    plans: [Plan; 3],
}

impl<'m> Workload<'m> {
    /// Evaluates the materials at the directions of the pool.
    #[must_use]
    pub fn new(materials: &'m [Box<dyn Material>]) -> Self {
        let models = [ModelKind::Neural, ModelKind::Phong, ModelKind::CookTorrance];
        Self {
            tasks: TaskSet {
                materials,
                pool: Pool::new(materials, POOL_SIZE, SEED),
            },
            pattern: Pattern::new(sobol_valid(PATTERN_SIZE, SEED as u32)),
            plans: models.map(|model| {
                let effort = Effort::Standard;
                Plan::new(
                    Schedule::Joint,
                    effort,
                    model,
                    PATTERN_SIZE,
                    materials.len(),
                )
            }),
        }
    }

    /// Returns the items of one model, or all items if `model` is None.
    ///
    /// Run them on a thread of the thread pool, inside [`rayon::scope`]. From any other thread, each transfer to the
    /// pool takes about 10 us.
    #[must_use]
    pub fn items(&self, model: Option<ModelKind>) -> Vec<Item<'_>> {
        let mut items = Vec::new();
        let [neural, phong, cook_torrance] = &self.plans;
        self.add_model_items::<Neural>(neural, &mut items);
        self.add_neural_kernels(&mut items);
        self.add_model_items::<Phong>(phong, &mut items);
        self.add_model_items::<CookTorrance>(cook_torrance, &mut items);
        items.retain(|item| model.is_none_or(|model| item.model == model));
        items
    }

    /// Adds the items of one model.
    fn add_model_items<'a, M: LaneModel + 'a>(&'a self, plan: &'a Plan, items: &mut Vec<Item<'a>>) {
        let is_neural = M::KIND == ModelKind::Neural;
        let if_neural = |count: u64| is_neural.then_some(count);
        items.push(Item {
            model: M::KIND,
            work: "20 steps of 512 fresh samples, outer 512",
            threads: Threads::All,
            tasks: 1,
            multiply_accumulates: if_neural(neural::outer_step(512, 512, false)),
            run: self.fresh_samples_run::<M>(512, 512),
        });
        items.push(Item {
            model: M::KIND,
            work: "20 steps of a pattern of 8, outer 512",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: if_neural(neural::outer_step(PATTERN_SIZE, 512, true)),
            run: self.pattern_run::<M>(512),
        });
        items.push(Item {
            model: M::KIND,
            work: "20 steps of a pattern of 8, outer 25,000",
            threads: Threads::All,
            tasks: 1,
            multiply_accumulates: if_neural(neural::outer_step(PATTERN_SIZE, 25_000, true)),
            run: self.pattern_run::<M>(25_000),
        });
        let is_pattern_descent = |phase: &Phase| {
            phase.inner_samples == InnerSamples::Pattern && phase.search == SearchMethod::Gradient
        };
        let phases = plan.phases.iter().enumerate();
        if let Some((phase_index, phase)) =
            phases.rev().find(|(_, phase)| is_pattern_descent(phase))
        {
            let task_work = neural::outer_step(PATTERN_SIZE, phase.outer_samples, true);
            let first_step = OuterStep {
                phase,
                phase_index,
                step: 0,
            };
            items.push(Item {
                model: M::KIND,
                work: "a training step, pattern of 8, outer 256, per task",
                threads: Threads::All,
                tasks: phase.batch,
                multiply_accumulates: if_neural(phase.batch as u64 * task_work),
                run: self.training_step_run::<M>(plan, first_step),
            });
        }
    }

    /// Returns an inner loop with untrained initial parameters and step sizes.
    fn untrained_inner_loop<M: LaneModel>(&self) -> InnerLoop<M, f32> {
        let initial = initial_guess(M::KIND, &mut generator());
        let step_sizes = vec![1e-3; initial.len()];
        InnerLoop::new(&initial, &step_sizes, INNER_STEPS)
    }

    /// Returns one run of the paper's first stage: fresh samples at every step.
    fn fresh_samples_run<'a, M: LaneModel + 'a>(
        &'a self,
        inner: usize,
        outer: usize,
    ) -> Box<dyn FnMut() + 'a> {
        let inner_loop = self.untrained_inner_loop::<M>();
        let mut generator = generator();
        let mut draw = |count| self.tasks.pool.draw(0, count, &mut generator);
        let draws: Vec<_> = (0..inner_loop.steps).map(|_| draw(inner)).collect();
        let outer = draw(outer);
        let mut gradient = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let lists: Vec<_> = draws
                .iter()
                .map(|draw| draw.octets().back_to_back())
                .collect();
            let lists: Vec<_> = lists.iter().collect();
            M::meta_gradient(&mut gradient, &inner_loop, &lists, &outer.octets(), None);
        })
    }

    /// Returns one run of the paper's second stage and of the joint schedule: the pattern's samples at every step, and
    /// the gradient with respect to the pattern.
    fn pattern_run<'a, M: LaneModel + 'a>(&'a self, outer: usize) -> Box<dyn FnMut() + 'a> {
        let inner_loop = self.untrained_inner_loop::<M>();
        let outer = self.tasks.pool.draw(0, outer, &mut generator());
        let material = &*self.tasks.materials[0];
        let measured = self.pattern.measure(material);
        let mut gradient = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let inner = measured.octets();
            let mut derivatives = inner.zero_derivatives();
            let outer = outer.octets();
            M::meta_gradient(
                &mut gradient,
                &inner_loop,
                &[&inner],
                &outer,
                Some(&mut derivatives),
            );
            std::hint::black_box(measured.gradient_by_logits(&derivatives));
        })
    }

    /// Returns one run of a complete training step: draws, measurements, a batch of meta-gradients, and Adam.
    fn training_step_run<'a, M: LaneModel + 'a>(
        &'a self,
        plan: &'a Plan,
        first_step: OuterStep<'a>,
    ) -> Box<dyn FnMut() + 'a> {
        let initial = initial_guess(M::KIND, &mut generator());
        let step_size = plan.step_size_encoding.encode(plan.initial_step_size);
        let angles = self.pattern.angles().iter().copied();
        let objective = DescentObjective::<M> {
            training: &self.tasks,
            validation: &self.tasks,
            plan,
            inner_steps: INNER_STEPS,
            streams: RandomStreams { seed: SEED },
            model: PhantomData,
        };
        let mut optimizer = Optimizer::new(Groups {
            hyperparameters: vec![step_size; initial.len()],
            initial,
            pattern: angles.flat_map(logits_from_angles).collect(),
            ..Groups::default()
        });
        let mut step = 0;
        Box::new(move || {
            let values = optimizer.values();
            let (_, gradient) = objective.gradient(&values, OuterStep { step, ..first_step });
            optimizer.step(gradient, &first_step.phase.rates_at(step));
            step = (step + 1) % first_step.phase.steps;
        })
    }

    /// Adds the kernels that take most of the time, on one thread: the gradient and the Hessian times a vector, each
    /// summed over samples.
    fn add_neural_kernels<'a>(&'a self, items: &mut Vec<Item<'a>>) {
        let theta = self.untrained_inner_loop::<Neural>().initial;
        let draw = self.tasks.pool.draw(0, 512, &mut generator());
        let mut gradient = theta;
        items.push(Item {
            model: ModelKind::Neural,
            work: "gradient over 512 samples",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: Some(512 * neural::gradient()),
            run: Box::new(move || {
                Neural::gradient(&theta, &draw.octets(), &mut gradient);
            }),
        });
        let draw = self.tasks.pool.draw(0, 256, &mut generator());
        let mut product = theta;
        let mut dual = Dual::constants::<Neural>(&theta);
        for entry in dual.iter_mut() {
            entry.tangent = [1e-3];
        }
        items.push(Item {
            model: ModelKind::Neural,
            work: "Hessian times vector over 256 samples",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: Some(256 * neural::product(false)),
            run: Box::new(move || {
                Neural::product(&dual, &draw.octets(), &mut product, None);
            }),
        });
    }
}

/// Returns a generator of random numbers in its initial state.
fn generator() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(SEED)
}
