//! Modes of a run: all experiments, a list of their cells, or a single cell. A cell is one training or one evaluation.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::path::PathBuf;

use glimpse_core::model::ModelKind;
use glimpse_materials::Material;
use glimpse_materials::sampling::sobol_valid;
use glimpse_trainer::evaluation::MaterialMetrics;
use glimpse_trainer::metrics::Metrics;
use glimpse_training::meta::initialization::initial_guess;
use glimpse_training::meta::learned::{
    LearnedFit, LearnedRecipe, LearnedSgd, ValidatedLoss, ValidationSplit,
};
use glimpse_training::meta::objective::LossEstimate;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::recipe::pack_recipe;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::stored::{Evaluation, TrainedRecipe};

/// The mode of a run.
#[derive(Debug)]
pub(crate) enum RunMode {
    /// Runs the experiments and writes their findings.
    All,
    /// Lists the cells of the experiments and does not run them.
    List(CellPlan),
    /// Runs one cell.
    Only(TargetCell),
}

/// The only cell that a run computes.
#[derive(Debug, Default)]
pub(crate) struct TargetCell {
    /// Path in the output folder, without extension.
    name: String,
    /// True once an experiment has requested the cell.
    reached: Cell<bool>,
    /// True while the cell is evaluated.
    evaluating: Cell<bool>,
}

impl TargetCell {
    /// Creates the target from its name.
    pub(crate) fn new(name: String) -> Self {
        Self {
            name,
            ..Self::default()
        }
    }

    /// Returns true if an experiment has requested the cell. Its files then exist.
    pub(crate) fn was_reached(&self) -> bool {
        self.reached.get()
    }

    /// Returns true if `name` is the cell's name, and then marks the cell as reached.
    pub(super) fn mark_if_named(&self, name: &str) -> bool {
        let is_named = self.name == name;
        self.reached.set(self.reached.get() || is_named);
        is_named
    }

    /// Returns true while the cell is evaluated.
    pub(super) fn is_evaluating(&self) -> bool {
        self.evaluating.get()
    }

    /// Runs the cell's evaluation. [`is_evaluating`](Self::is_evaluating) is true meanwhile.
    pub(super) fn evaluate<T>(&self, run: impl FnOnce() -> T) -> T {
        self.evaluating.set(true);
        let result = run();
        self.evaluating.set(false);
        result
    }
}

impl RunMode {
    /// Returns true if methods are evaluated now, and not only listed.
    pub(super) fn evaluates(&self) -> bool {
        match self {
            Self::All => true,
            Self::Only(target) => target.is_evaluating(),
            Self::List(_) => false,
        }
    }
}

/// A cell of a list, with its files.
#[derive(Clone, Debug)]
pub(crate) struct PlannedCell {
    /// Path in the output folder, without extension.
    pub(crate) name: String,
    /// Files that it reads.
    pub(crate) inputs: Vec<PathBuf>,
    /// Files that it writes.
    pub(crate) outputs: Vec<PathBuf>,
    /// Checkpoint of an unfinished training.
    pub(crate) checkpoint: Option<PathBuf>,
    /// True if all outputs exist.
    pub(crate) is_done: bool,
}

/// The requested cells. Each cell follows its prerequisites.
#[derive(Debug, Default)]
pub(crate) struct CellPlan {
    cells: RefCell<Vec<PlannedCell>>,
    /// Files of the recipes that were requested since the last call of [`CellPlan::take_recipes`].
    recipes: RefCell<Vec<PathBuf>>,
}

impl CellPlan {
    /// Adds a cell unless the plan already contains it.
    pub(super) fn add(&self, cell: PlannedCell) {
        let mut cells = self.cells.borrow_mut();
        if cells.iter().all(|other| other.name != cell.name) {
            cells.push(cell);
        }
    }

    /// Records the files of a requested recipe.
    pub(super) fn add_recipe(&self, files: &[PathBuf]) {
        self.recipes.borrow_mut().extend_from_slice(files);
    }

    /// Returns the files of the recipes that were requested since the last call.
    pub(super) fn take_recipes(&self) -> Vec<PathBuf> {
        self.recipes.take()
    }

    /// Returns all cells.
    pub(crate) fn cells(&self) -> Vec<PlannedCell> {
        self.cells.borrow().clone()
    }
}

/// The error of a method that is requested in a run without its evaluation.
#[derive(Debug)]
pub(super) struct NotEvaluated;

impl fmt::Display for NotEvaluated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("this run lists cells without evaluating them")
    }
}

impl std::error::Error for NotEvaluated {}

/// Returns an untrained recipe for a run that only records which recipes its cells require. Its model is Neural, even if
/// the case has another model.
pub(super) fn blank_recipe(samples: usize) -> anyhow::Result<TrainedRecipe> {
    const MODEL: ModelKind = ModelKind::Neural;
    let initial = initial_guess(MODEL, &mut ChaCha8Rng::seed_from_u64(0));
    let options = Options::new(MODEL, samples, Schedule::Joint, Effort::Brief, 0);
    let learned = LearnedRecipe {
        pattern: sobol_valid(samples, 0),
        fit: LearnedFit::Sgd(LearnedSgd {
            model: MODEL,
            steps: 1,
            step_sizes: vec![1e-3; initial.len()],
            initial,
        }),
        loss_predictor: None,
        basis: None,
        expected_loss: ValidatedLoss {
            estimate: LossEstimate::new(1.0, [1.0; 2].into_iter()),
            split: ValidationSplit::Training,
        },
        materials: Vec::new(),
    };
    Ok(TrainedRecipe {
        file: pack_recipe(&learned, &options, "nothing")?,
        basis: None,
    })
}

/// Returns constant metrics for a run that only records its cells. They are never written.
pub(super) fn blank_evaluation(seeds: u64, materials: &[Box<dyn Material>]) -> Evaluation {
    let metrics = Metrics {
        loss: 1.0,
        dssim: 1.0,
        l2: 1.0,
        psnr: 1.0,
        delta_e: 1.0,
    };
    let material_metrics = materials.iter().map(|material| MaterialMetrics {
        name: material.name().to_owned(),
        metrics,
        predicted_loss: None,
        loss_bound: None,
        unlike_training: None,
    });
    Evaluation {
        metrics,
        seeds,
        loss_spread: 0.0,
        materials: material_metrics.collect(),
    }
}
