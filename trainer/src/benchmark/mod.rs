//! The work that meta-learning spends its time on, as items to be timed: `trainer bench` prints
//! them, `cargo bench` watches them.
//!
//! An item is one outer step of one task, the unrolled inner loop with its exact adjoint, as
//! training computes it; or a part of it; or a whole outer step over a batch of tasks.
//!
//! The peak that they are held against is measured in the same run, see [`peak()`].

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
use glimpse_optimizer::{Groups, Optimization};
use glimpse_training::meta::descent::{DescentObjective, Tasks};
use glimpse_training::meta::objective::{MetaObjective, RandomStreams};
use glimpse_training::meta::pattern::{Pattern, logits_of};
use glimpse_training::meta::phase::{InnerSamples, OuterStep, Phase, SearchMethod};
use glimpse_training::meta::plan::{Effort, Plan, Schedule};
use glimpse_training::meta::pool::Pool;
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::meta::start::first_guess;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use peak::{Peak, peak};
pub use timing::{Timing, measure};

/// How many materials there are to draw from, procedural ones.
const MATERIALS: usize = 32;
/// Directions at which each of them is known.
const POOL: usize = 32_768;
/// How many samples a pattern has here.
const PATTERN: usize = 8;
/// The seed of it all: times of one run compare with those of another.
const SEED: u64 = 1;

/// On how many threads an item runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Threads {
    /// One: it is too short to be shared.
    One,
    /// All of the thread pool's.
    All,
}

impl Threads {
    /// How many that are now.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::All => rayon::current_num_threads(),
        }
    }
}

/// Some work to be timed.
pub struct Item<'a> {
    /// The model.
    pub model: ModelKind,
    /// What is done, without the model.
    pub work: &'static str,
    /// On how many threads.
    pub threads: Threads,
    /// How many tasks one run does.
    pub tasks: usize,
    /// Multiply-accumulates of all matrix products in one run; none are claimed for the small
    /// models, which are exponentials and divisions for the most part.
    pub multiply_accumulates: Option<u64>,
    run: Box<dyn FnMut() + 'a>,
}

impl Item<'_> {
    /// The model and the work.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}: {}", self.model, self.work)
    }

    /// Does the work once.
    pub fn run(&mut self) {
        (self.run)();
    }
}

/// The materials of all items.
#[must_use]
pub fn materials() -> Vec<Box<dyn Material>> {
    Procedural::set(MATERIALS, SEED)
        .into_iter()
        .map(|material| Box::new(material) as _)
        .collect()
}

/// What items draw from.
pub struct Ground<'m> {
    tasks: Tasks<'m>,
    pattern: Pattern,
    plans: [Plan; 3],
}

impl<'m> Ground<'m> {
    /// Evaluates the materials at a pool of directions.
    #[must_use]
    pub fn new(materials: &'m [Box<dyn Material>]) -> Self {
        let models = [ModelKind::Neural, ModelKind::Phong, ModelKind::CookTorrance];
        Self {
            tasks: Tasks {
                materials,
                pool: Pool::new(materials, POOL, SEED),
            },
            pattern: Pattern::new(sobol_valid(PATTERN, SEED as u32)),
            plans: models.map(|model| {
                let effort = Effort::Standard;
                Plan::new(Schedule::Joint, effort, model, PATTERN, materials.len())
            }),
        }
    }

    /// All items, or those of one model.
    ///
    /// They are to be run on a thread of the pool, inside [`rayon::scope`]: from elsewhere each
    /// hand-over to the pool costs some 10 us.
    #[must_use]
    pub fn items(&self, model: Option<ModelKind>) -> Vec<Item<'_>> {
        let mut items = Vec::new();
        let [neural, phong, cook_torrance] = &self.plans;
        self.items_of::<Neural>(neural, &mut items);
        self.neural_kernels(&mut items);
        self.items_of::<Phong>(phong, &mut items);
        self.items_of::<CookTorrance>(cook_torrance, &mut items);
        items.retain(|item| model.is_none_or(|model| item.model == model));
        items
    }

    fn items_of<'a, M: LaneModel + 'a>(&'a self, plan: &'a Plan, items: &mut Vec<Item<'a>>) {
        let is_neural = M::KIND == ModelKind::Neural;
        let counted = |count: u64| is_neural.then_some(count);
        items.push(Item {
            model: M::KIND,
            work: "20 steps of 512 fresh samples, outer 512",
            threads: Threads::All,
            tasks: 1,
            multiply_accumulates: counted(neural::outer_step(512, 512, false)),
            run: self.on_fresh_samples::<M>(512, 512),
        });
        items.push(Item {
            model: M::KIND,
            work: "20 steps of a pattern of 8, outer 512",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: counted(neural::outer_step(PATTERN, 512, true)),
            run: self.on_pattern::<M>(512),
        });
        items.push(Item {
            model: M::KIND,
            work: "20 steps of a pattern of 8, outer 25,000",
            threads: Threads::All,
            tasks: 1,
            multiply_accumulates: counted(neural::outer_step(PATTERN, 25_000, true)),
            run: self.on_pattern::<M>(25_000),
        });
        let on_pattern = |phase: &Phase| {
            phase.inner == InnerSamples::Pattern && phase.search == SearchMethod::Gradient
        };
        let phases = plan.phases.iter().enumerate();
        if let Some((number, phase)) = phases.rev().find(|(_, phase)| on_pattern(phase)) {
            let each = neural::outer_step(PATTERN, phase.outer, true);
            let first = OuterStep {
                phase,
                number,
                step: 0,
            };
            items.push(Item {
                model: M::KIND,
                work: "a training step, pattern of 8, outer 256, per task",
                threads: Threads::All,
                tasks: phase.batch,
                multiply_accumulates: counted(phase.batch as u64 * each),
                run: self.training_step::<M>(plan, first),
            });
        }
    }

    fn first_inner_loop<M: LaneModel>(&self) -> InnerLoop<M, f32> {
        let initial = first_guess(M::KIND, &mut random());
        let step_sizes = vec![1e-3; initial.len()];
        InnerLoop::new(&initial, &step_sizes, INNER_STEPS)
    }

    /// The paper's first stage: fresh samples at every step.
    fn on_fresh_samples<'a, M: LaneModel + 'a>(
        &'a self,
        inner: usize,
        outer: usize,
    ) -> Box<dyn FnMut() + 'a> {
        let inner_loop = self.first_inner_loop::<M>();
        let mut random = random();
        let mut draw = |count| self.tasks.pool.draw(0, count, &mut random);
        let draws: Vec<_> = (0..inner_loop.steps).map(|_| draw(inner)).collect();
        let outer = draw(outer);
        let mut found = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let lists: Vec<_> = draws.iter().map(|draw| draw.octets().in_a_row()).collect();
            let lists: Vec<_> = lists.iter().collect();
            M::meta_gradient(&mut found, &inner_loop, &lists, &outer.octets(), None);
        })
    }

    /// The paper's second stage, and the joint schedule: the pattern's samples at every step, and
    /// the gradient by them too.
    fn on_pattern<'a, M: LaneModel + 'a>(&'a self, outer: usize) -> Box<dyn FnMut() + 'a> {
        let inner_loop = self.first_inner_loop::<M>();
        let outer = self.tasks.pool.draw(0, outer, &mut random());
        let material = &*self.tasks.materials[0];
        let measured = self.pattern.measure(material);
        let mut found = MetaGradient::<M, f32>::default();
        Box::new(move || {
            let inner = measured.octets();
            let mut derivatives = inner.zero_derivatives();
            let outer = outer.octets();
            M::meta_gradient(
                &mut found,
                &inner_loop,
                &[&inner],
                &outer,
                Some(&mut derivatives),
            );
            std::hint::black_box(measured.gradient_by_logits(&derivatives));
        })
    }

    /// All that users wait for: draws, measurements, a batch of meta-gradients, Adam.
    fn training_step<'a, M: LaneModel + 'a>(
        &'a self,
        plan: &'a Plan,
        first: OuterStep<'a>,
    ) -> Box<dyn FnMut() + 'a> {
        let initial = first_guess(M::KIND, &mut random());
        let step_size = plan.step_size_form.value(plan.first_step_size);
        let angles = self.pattern.angles().iter().copied();
        let objective = DescentObjective::<M> {
            training: &self.tasks,
            validation: &self.tasks,
            plan,
            inner_steps: INNER_STEPS,
            streams: RandomStreams { seed: SEED },
            model: PhantomData,
        };
        let mut optimization = Optimization::new(Groups {
            hyperparameters: vec![step_size; initial.len()],
            initial,
            pattern: angles.flat_map(logits_of).collect(),
            ..Groups::default()
        });
        let mut step = 0;
        Box::new(move || {
            let values = optimization.values();
            let (_, gradient) = objective.gradient(&values, OuterStep { step, ..first });
            optimization.step(gradient, &first.phase.rates_at(step));
            step = (step + 1) % first.phase.steps;
        })
    }

    /// The two sums over samples that all the time is spent in, on one thread.
    fn neural_kernels<'a>(&'a self, items: &mut Vec<Item<'a>>) {
        let theta = self.first_inner_loop::<Neural>().initial;
        let draw = self.tasks.pool.draw(0, 512, &mut random());
        let mut gradient = theta;
        items.push(Item {
            model: ModelKind::Neural,
            work: "gradient over 512 samples",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: Some(512 * neural::gradient()),
            run: Box::new(move || {
                let samples = draw.octets();
                Neural::gradient_of(&theta, &samples, 0..samples.octets(), &mut gradient);
            }),
        });
        let draw = self.tasks.pool.draw(0, 512, &mut random());
        let mut product = theta;
        let mut dual = Dual::constants::<Neural>(&theta);
        for entry in dual.iter_mut() {
            entry.tangent = [1e-3];
        }
        items.push(Item {
            model: ModelKind::Neural,
            work: "Hessian times vector over 512 samples",
            threads: Threads::One,
            tasks: 1,
            multiply_accumulates: Some(512 * neural::product(false)),
            run: Box::new(move || {
                let samples = draw.octets();
                Neural::product_of(&dual, &samples, 0..samples.octets(), &mut product, None);
            }),
        });
    }
}

fn random() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(SEED)
}
