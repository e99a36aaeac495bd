//! A whole training run: from materials to what a recipe holds.

use std::fmt;
use std::marker::PhantomData;

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{MAX_PRECISION, MIN_PRECISION};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::checkpoint::CheckpointError;
use super::descent::{DescentTrainee, Tasks};
use super::linear::LinearTrainee;
use super::outer::{Checkpoints, Observer, Outcome, Run, RunError};
use super::pattern::above_horizon;
use super::plan::{Effort, Known, Plan, Schedule};
use super::pool::Pool;
use super::prior::draw::{Group, Variety};
use super::prior::pool::WarpedPool;
use super::prior::refinement::{Refinement, Steps};
use super::prior::trainee::{Centres, PriorTasks, PriorTrainee, SCALE};
use super::prior::warp::Warp;
use super::trainee::{Expected, RandomStreams, Trainee};
use crate::linear::{Basis, Columns, Prior, ReducedBasis};
use crate::material::{Identity, Material, Procedural};
use glimpse_kernels::LaneModel;
use glimpse_kernels::completion::Shape;
use glimpse_kernels::with_model;

/// SGD steps of the inner loop (paper: 20).
pub const INNER_STEPS: usize = 20;
/// Directions at which training materials are evaluated once.
const POOL: usize = 32_768;
/// The same for materials held out for validation.
const VALIDATION_POOL: usize = 4_096;

/// SGD steps from a completed start.
const STARTED_STEPS: usize = 1;
/// m of a completion.
const COMPLETED_COMPONENTS: usize = 24;
/// h of a completion.
const HIDDEN: usize = 64;
/// g of a start.
const UNITS: usize = 32;
/// What the loss of completed coefficients counts for where a descent follows.
const AUXILIARY: f32 = 0.3;
/// Directions at which materials are evaluated once for a completion, with each warp.
const PRIOR_POOL: usize = 8_192;
/// How many procedural materials are mixed in, and of which set.
const PROCEDURAL: usize = 400;
const PROCEDURAL_SEED: u64 = 5;

/// What to train.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: ModelKind,
    /// n.
    pub samples: usize,
    /// How.
    pub schedule: Schedule,
    /// How long.
    pub effort: Effort,
    /// What of it.
    pub parts: Parts,
    /// The prior of Linear's coefficients; other models have none.
    pub prior: Prior,
    /// What readings and materials a completion is trained on.
    pub completing: Completing,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where the run is saved, if it is.
    pub checkpoints: Option<Checkpoints>,
}

/// What readings and materials a completion is trained on, besides those given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Completing {
    /// The share of tasks with missing readings; 0 makes a recipe that needs them all.
    pub missing: f32,
    /// Standard deviation of readings' noise, relative.
    pub noise: f32,
    /// The share of tasks that are procedural materials.
    pub procedural: f32,
}

impl Default for Completing {
    fn default() -> Self {
        Self {
            missing: 0.0,
            noise: 0.0,
            procedural: 0.15,
        }
    }
}

impl fmt::Display for Completing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            missing,
            noise,
            procedural,
        } = self;
        write!(
            f,
            "missing readings {missing}, noise {noise}, procedural {procedural}"
        )
    }
}

/// What of a recipe is trained.
#[derive(Clone, Debug, PartialEq)]
pub enum Parts {
    /// Start, step sizes and pattern.
    All,
    /// All, and then start and step sizes once more, and the pattern once more.
    AllTwice,
    /// Start and step sizes, as the method Meta does.
    WithoutPattern,
    /// The pattern, for a start and step sizes that are known. (Linear: as [`Parts::All`].)
    PatternOnly(Known),
}

impl Parts {
    /// In words, as part of a run's name.
    fn name(&self) -> String {
        match self {
            Self::All => "pattern=true".into(),
            Self::AllTwice => "pattern=twice".into(),
            Self::WithoutPattern => "pattern=false".into(),
            Self::PatternOnly(known) => {
                let values = known.initial.iter().chain(&known.step_sizes);
                let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
                format!("pattern=only for {:08x}", crc(&bytes))
            }
        }
    }
}

impl Options {
    /// All that decides the outcome, in words: two runs with the same words give the same bytes.
    fn run(&self, materials: &[Box<dyn Material>]) -> String {
        let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
        let prior = match self.model {
            ModelKind::Linear => format!(" {:?}", self.prior),
            _ => String::new(),
        };
        let completing = match self.schedule {
            Schedule::Prior => format!(" {}", self.completing),
            _ => String::new(),
        };
        format!(
            "{}{prior}{completing} n={} {:?} {:?} {} seed={} {} materials {:08x}",
            self.model,
            self.samples,
            self.schedule,
            self.effort,
            self.parts.name(),
            self.seed,
            names.len(),
            crc(names.join("\n").as_bytes()),
        )
    }
}

fn crc(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}

/// What was learned.
#[derive(Clone, Debug, PartialEq)]
pub enum Learned {
    /// For a model that is fitted by descent.
    Descent(LearnedDescent),
    /// For the model Linear.
    Ridge(LearnedRidge),
    /// For any model, by schedule prior.
    Completed(Box<LearnedCompleted>),
}

/// What was learned for a model that is fitted by descent.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedDescent {
    /// The model.
    pub model: ModelKind,
    /// K.
    pub inner_steps: usize,
    /// Where to measure; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha.
    pub step_sizes: Vec<f32>,
    /// What to expect of an unseen material.
    pub promise: Promise,
    /// The materials that it was trained on, those held out for validation among them.
    pub materials: Vec<Identity>,
}

/// What was learned by schedule prior.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedCompleted {
    /// The model.
    pub model: ModelKind,
    /// Where to measure; both directions of each sample are above the horizon.
    pub pattern: Vec<Angles<f32>>,
    /// How large the completion is, and the start.
    pub shape: Shape,
    /// Whether it was trained to do without some of the readings.
    pub takes_missing: bool,
    /// What each sample's logarithm is centred by, n.
    pub centre: Vec<f32>,
    /// What it is multiplied by then.
    pub scale: f32,
    /// Weights of the completion.
    pub completion: Vec<f32>,
    /// What its coefficients become.
    pub target: LearnedTarget,
    /// What to expect of an unseen material.
    pub promise: Promise,
    /// The materials that it was trained on, those held out for validation among them.
    pub materials: Vec<Identity>,
}

/// What coefficients become.
#[derive(Clone, Debug, PartialEq)]
pub enum LearnedTarget {
    /// The model Linear.
    Linear {
        /// The components at the pattern, n rows of m.
        rows: Vec<f32>,
        /// The file of the whole basis.
        basis: Vec<u8>,
    },
    /// Where a descent starts.
    Descent {
        /// K.
        inner_steps: usize,
        /// Phi.
        initial: Vec<f32>,
        /// alpha.
        step_sizes: Vec<f32>,
        /// Weights of the start.
        start: Vec<f32>,
    },
}

/// What was learned for the model Linear.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedRidge {
    /// The basis at the pattern.
    pub reduced: ReducedBasis,
    /// The file of the whole basis.
    pub basis: Vec<u8>,
    /// What to expect of an unseen material.
    pub promise: Promise,
    /// The materials that it was trained on.
    pub materials: Vec<Identity>,
}

/// What to expect of an unseen material, and on which materials that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Promise {
    /// The loss.
    pub expected: Expected,
    /// On which.
    pub on: JudgedOn,
}

/// On which materials a loss was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JudgedOn {
    /// Materials that training did not see.
    HeldOut,
    /// Those of training: with fewer than ten none are held out.
    Training,
    /// Those of training, each with a basis of others, as Linear is learned.
    LeftOut,
}

impl fmt::Display for JudgedOn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::HeldOut => "held out of training",
            Self::Training => "that it was trained on",
            Self::LeftOut => "that it was trained on, each with a basis of others",
        })
    }
}

impl Learned {
    /// What to expect of an unseen material.
    #[must_use]
    pub fn promise(&self) -> &Promise {
        match self {
            Self::Descent(learned) => &learned.promise,
            Self::Ridge(learned) => &learned.promise,
            Self::Completed(learned) => &learned.promise,
        }
    }

    /// The materials that it was trained on, those held out for validation among them.
    #[must_use]
    pub fn materials(&self) -> &[Identity] {
        match self {
            Self::Descent(learned) => &learned.materials,
            Self::Ridge(learned) => &learned.materials,
            Self::Completed(learned) => &learned.materials,
        }
    }

    /// The file of the whole basis that has to lie beside the recipe, for the model Linear.
    #[must_use]
    pub fn basis(&self) -> Option<&[u8]> {
        match self {
            Self::Ridge(learned) => Some(&learned.basis),
            Self::Completed(learned) => match &learned.target {
                LearnedTarget::Linear { basis, .. } => Some(basis),
                LearnedTarget::Descent { .. } => None,
            },
            Self::Descent(_) => None,
        }
    }
}

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Nothing to learn from.
    #[error("there are no materials to train on")]
    NoMaterials,
    /// n is out of range.
    #[error("{0} samples are out of range: a pattern has 1 to {max}", max = glimpse_core::recipe::MAX_SAMPLES)]
    Samples(usize),
    /// A number of the finished recipe is no number.
    #[error("training did not converge: {0}")]
    Diverged(#[from] glimpse_core::fit::ridge::RidgeError),
    /// A checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The observer asked to stop; a checkpoint was written if there is a place for it.
    #[error("stopped after {0} outer steps")]
    Stopped(usize),
}

impl From<RunError> for TrainError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Checkpoint(error) => Self::Checkpoint(error),
            RunError::Stopped(done) => Self::Stopped(done),
        }
    }
}

/// Trains, telling `observer` after every outer step.
///
/// The outcome depends on the options and the materials only, not on the number of threads, nor
/// on how often the run was stopped and resumed.
///
/// # Errors
/// See [`TrainError`].
pub fn train(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<Learned, TrainError> {
    if materials.is_empty() {
        return Err(TrainError::NoMaterials);
    }
    if !(1..=glimpse_core::recipe::MAX_SAMPLES).contains(&options.samples) {
        return Err(TrainError::Samples(options.samples));
    }
    // On one of rayon's own threads: each parallel loop would else be handed over to one.
    rayon::scope(|_| {
        let session = Session::new(options, materials);
        if options.schedule == Schedule::Prior {
            let found = with_model!(
                options.model,
                M => session.completed(Some(&Steps::<M>::new(STARTED_STEPS)), observer),
                _ => session.completed(None, observer),
            );
            return found.map(|learned| Learned::Completed(Box::new(learned)));
        }
        with_model!(
            options.model,
            M => session.descent::<M>(observer).map(Learned::Descent),
            _ => session.ridge(observer).map(Learned::Ridge),
        )
    })
}

/// What the training of any model needs.
struct Session<'o> {
    options: &'o Options,
    name: String,
    plan: Plan,
    /// Of all materials, in their own order.
    identities: Vec<Identity>,
    training: Vec<Box<dyn Material>>,
    validation: Vec<Box<dyn Material>>,
}

impl<'o> Session<'o> {
    fn new(options: &'o Options, materials: Vec<Box<dyn Material>>) -> Self {
        let name = options.run(&materials);
        let identities = materials.iter().map(|each| Identity::of(&**each)).collect();
        let (training, validation) = split(materials, options.seed);
        let mut plan = Plan::new(
            options.schedule,
            options.effort,
            options.model,
            options.samples,
            training.len(),
        );
        plan = match &options.parts {
            Parts::All => plan,
            Parts::AllTwice => plan.twice(),
            Parts::WithoutPattern => plan.without_pattern(options.samples),
            Parts::PatternOnly(known) => plan.pattern_only(known.clone()),
        };
        if options.model == ModelKind::Linear && options.prior.eta.is_some() {
            plan = plan.without_step_sizes();
        }
        Self {
            options,
            name,
            plan,
            identities,
            training,
            validation,
        }
    }

    /// The materials held out, or those of training if none are.
    fn judged(&self) -> &[Box<dyn Material>] {
        match self.validation.is_empty() {
            true => &self.training,
            false => &self.validation,
        }
    }

    fn judged_on(&self) -> JudgedOn {
        match self.validation.is_empty() {
            true => JudgedOn::Training,
            false => JudgedOn::HeldOut,
        }
    }

    /// Trains; returns the best values and their loss.
    fn finish(
        &self,
        trainee: &dyn Trainee,
        observer: &mut Observer<'_>,
    ) -> Result<Outcome, TrainError> {
        let run = Run {
            trainee,
            plan: &self.plan,
            name: self.name.clone(),
            seed: self.options.seed,
            checkpoints: self.options.checkpoints.clone(),
        };
        Ok(run.finish(observer)?)
    }

    fn descent<M: LaneModel>(
        &self,
        observer: &mut Observer<'_>,
    ) -> Result<LearnedDescent, TrainError> {
        let seed = self.options.seed;
        let tasks = |materials, size, seed| Tasks {
            pool: Pool::new(materials, size, seed),
            materials,
        };
        let trainee = DescentTrainee::<M> {
            training: &tasks(&self.training, POOL, seed),
            validation: &tasks(self.judged(), VALIDATION_POOL, !seed),
            plan: &self.plan,
            inner_steps: INNER_STEPS,
            streams: RandomStreams { seed },
            model: PhantomData,
        };
        let Outcome { expected, values } = self.finish(&trainee, observer)?;
        Ok(LearnedDescent {
            model: M::KIND,
            inner_steps: INNER_STEPS,
            pattern: above_horizon(&values.pattern),
            initial: values.initial,
            step_sizes: self.plan.step_size_form.step_sizes(&values.hyperparameters),
            promise: Promise {
                expected,
                on: self.judged_on(),
            },
            materials: self.identities.clone(),
        })
    }

    /// A completion, and what it starts.
    fn completed(
        mut self,
        refinement: Option<&dyn Refinement>,
        observer: &mut Observer<'_>,
    ) -> Result<LearnedCompleted, TrainError> {
        let (completing, seed) = (self.options.completing, self.options.seed);
        let samples = self.options.samples;
        let columns = Columns::new(&self.training);
        let all: Vec<usize> = (0..columns.count()).collect();
        // Coefficients of about 1, as a small map is best at.
        let share = 1.0 / (columns.count() as f32).sqrt();
        let basis = Basis::new(&columns, &all, COMPLETED_COMPONENTS).scaled(share);
        let own = self.training.len();
        let groups = match completing.procedural > 0.0 {
            true => {
                let set = Procedural::set(PROCEDURAL, PROCEDURAL_SEED).into_iter();
                let set = set.map(|each| Box::new(each) as Box<dyn Material>);
                self.training.extend(set);
                vec![
                    Group {
                        materials: 0..own,
                        share: 1.0 - completing.procedural,
                    },
                    Group {
                        materials: own..self.training.len(),
                        share: completing.procedural,
                    },
                ]
            }
            false => vec![Group {
                materials: 0..own,
                share: 1.0,
            }],
        };
        let variety = Variety {
            missing: completing.missing,
            noise: [completing.noise, 0.0],
            ..Variety::default()
        };
        let tasks = |materials, warped, warps: &[Warp], size, seed| {
            let pool = WarpedPool::new(materials, warped, warps, size, seed);
            PriorTasks {
                table: pool.components(&basis),
                pool,
                materials,
            }
        };
        let parameters = refinement.map_or(0, |by| by.model().parameters().unwrap_or(0));
        let shape = Shape {
            samples,
            components: basis.components(),
            hidden: HIDDEN,
            units: if parameters > 0 { UNITS } else { 0 },
            parameters,
        };
        let training = tasks(&self.training, own, &variety.warps, PRIOR_POOL, seed);
        let judged = match self.validation.is_empty() {
            true => &self.training[..own],
            false => &self.validation,
        };
        let trainee = PriorTrainee {
            training: &training,
            validation: &tasks(judged, 0, &[Warp::NONE], PRIOR_POOL, !seed),
            basis: &basis,
            shape,
            groups,
            variety,
            weighing: self.plan.weighing,
            streams: RandomStreams { seed },
            refinement,
            first_step_size: self.plan.first_step_size,
            auxiliary: AUXILIARY,
        };
        let Outcome { expected, values } = self.finish(&trainee, observer)?;
        let pattern = above_horizon(&values.pattern);
        let centres = Centres::new(&basis, &pattern);
        let target = match refinement {
            None => LearnedTarget::Linear {
                rows: ReducedBasis::new(&basis, pattern.clone()).basis,
                basis: basis.to_bytes(),
            },
            Some(refinement) => LearnedTarget::Descent {
                inner_steps: refinement.steps(),
                initial: values.initial,
                step_sizes: self.plan.step_size_form.step_sizes(&values.hyperparameters),
                start: values.start,
            },
        };
        Ok(LearnedCompleted {
            model: self.options.model,
            pattern,
            shape,
            takes_missing: completing.missing > 0.0,
            centre: centres.values(),
            scale: SCALE,
            completion: values.completion,
            target,
            promise: Promise {
                expected,
                on: self.judged_on(),
            },
            materials: self.identities,
        })
    }

    /// Linear holds no materials out: each is learned on with a basis of others.
    fn ridge(mut self, observer: &mut Observer<'_>) -> Result<LearnedRidge, TrainError> {
        self.training.append(&mut self.validation);
        let columns = Columns::new(&self.training);
        let (prior, seed) = (self.options.prior, self.options.seed);
        let trainee = LinearTrainee::new(&self.training, &columns, prior, &self.plan, seed);
        let Outcome { expected, values } = self.finish(&trainee, observer)?;

        let all: Vec<usize> = (0..columns.count()).collect();
        let basis = Basis::new(&columns, &all, trainee.components());
        let bytes = basis.to_bytes();
        let mut reduced = ReducedBasis::new(&basis, above_horizon(&values.pattern));
        // A coefficient that is left free, or held at 0, may run out of what recipes hold.
        let precision = |log: &f32| log.exp().clamp(MIN_PRECISION, MAX_PRECISION);
        reduced.precision = values.hyperparameters.iter().map(precision).collect();
        reduced.basis_checksum = Basis::checksum(&bytes);
        Ok(LearnedRidge {
            reduced,
            basis: bytes,
            promise: Promise {
                expected,
                // A single material has nothing to be left out of.
                on: match self.identities.len() {
                    1 => JudgedOn::Training,
                    _ => JudgedOn::LeftOut,
                },
            },
            materials: self.identities,
        })
    }
}

/// Holds out every tenth material of a shuffled order; none of fewer than ten.
#[expect(clippy::type_complexity, reason = "two lists of materials")]
fn split(
    mut materials: Vec<Box<dyn Material>>,
    seed: u64,
) -> (Vec<Box<dyn Material>>, Vec<Box<dyn Material>>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    materials.shuffle(&mut random);
    let held_out = materials.len() / 10;
    let validation = materials.split_off(materials.len() - held_out);
    (materials, validation)
}
