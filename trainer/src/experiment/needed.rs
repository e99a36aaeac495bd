//! What experiments need, taken note of without being made.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::path::PathBuf;

use glimpse_core::model::ModelKind;
use glimpse_core::recipe::ValidationSplit;
use glimpse_materials::Material;
use glimpse_materials::sampling::sobol_valid;
use glimpse_trainer::evaluation::MaterialMetrics;
use glimpse_trainer::metrics::Metrics;
use glimpse_training::meta::learned::{Learned, LearnedDescent, LearnedFit, ValidatedLoss};
use glimpse_training::meta::objective::Expected;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::start::first_guess;
use glimpse_training::recipe::recipe_of;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::kept::{Evaluation, Recipe};

/// What experiments are run for.
#[derive(Debug)]
pub(crate) enum Purpose {
    /// To be made and written down.
    Everything,
    /// To take note of what they would train and judge.
    Listing(Notes),
    /// To make one thing of that.
    Only(Wanted),
}

/// One thing that experiments would train or judge.
#[derive(Debug, Default)]
pub(crate) struct Wanted {
    /// Its path in the experiments' folder, without an extension.
    name: String,
    /// True when it was come across.
    found: Cell<bool>,
    /// True while it is judged.
    judging: Cell<bool>,
}

impl Wanted {
    /// By its name.
    pub(crate) fn new(name: String) -> Self {
        Self {
            name,
            ..Self::default()
        }
    }

    /// True if it was come across: it is there now.
    pub(crate) fn was_found(&self) -> bool {
        self.found.get()
    }

    /// True of its own name.
    pub(super) fn is(&self, name: &str) -> bool {
        let is = self.name == name;
        self.found.set(self.found.get() || is);
        is
    }

    /// True while it is judged, by what has to be there.
    pub(super) fn is_judged(&self) -> bool {
        self.judging.get()
    }

    /// While it is judged.
    pub(super) fn judge<T>(&self, make: impl FnOnce() -> T) -> T {
        self.judging.set(true);
        let made = make();
        self.judging.set(false);
        made
    }
}

impl Purpose {
    /// True where methods are applied, and not only named.
    pub(super) fn judges(&self) -> bool {
        match self {
            Self::Everything => true,
            Self::Only(wanted) => wanted.is_judged(),
            Self::Listing(_) => false,
        }
    }
}

/// A recipe or a judgment.
#[derive(Clone, Debug)]
pub(crate) struct Needed {
    /// Its path in the experiments' folder, without an extension.
    pub(crate) name: String,
    /// Files that are needed for it.
    pub(crate) inputs: Vec<PathBuf>,
    /// Files that it is.
    pub(crate) outputs: Vec<PathBuf>,
    /// Where its training is kept while it lasts.
    pub(crate) checkpoint: Option<PathBuf>,
    /// True if it is there, and need not be made again.
    pub(crate) is_done: bool,
}

/// What was asked for, in order: each after all that it needs.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    all: RefCell<Vec<Needed>>,
    /// Files of the recipes that were asked for since this was last emptied.
    recipes: RefCell<Vec<PathBuf>>,
}

impl Notes {
    /// Takes note of something, once.
    pub(super) fn add(&self, needed: Needed) {
        let mut all = self.all.borrow_mut();
        if all.iter().all(|each| each.name != needed.name) {
            all.push(needed);
        }
    }

    /// A recipe was asked for.
    pub(super) fn asked_for(&self, files: &[PathBuf]) {
        self.recipes.borrow_mut().extend_from_slice(files);
    }

    /// The recipes that were asked for since this was last called.
    pub(super) fn recipes(&self) -> Vec<PathBuf> {
        self.recipes.take()
    }

    /// All of it.
    pub(crate) fn all(&self) -> Vec<Needed> {
        self.all.borrow().clone()
    }
}

/// A method is not applied where experiments are only asked what they need.
#[derive(Debug)]
pub(super) struct NotMade;

impl fmt::Display for NotMade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("this is only taken note of")
    }
}

impl std::error::Error for NotMade {}

/// What stands for a recipe that is not trained: of any model, one that is fitted by descent.
pub(super) fn blank_recipe(samples: usize) -> anyhow::Result<Recipe> {
    const MODEL: ModelKind = ModelKind::Neural;
    let initial = first_guess(MODEL, &mut ChaCha8Rng::seed_from_u64(0));
    let options = Options::new(MODEL, samples, Schedule::Joint, Effort::Brief, 0);
    let learned = Learned {
        pattern: sobol_valid(samples, 0),
        fit: LearnedFit::Descent(LearnedDescent {
            model: MODEL,
            inner_steps: 1,
            step_sizes: vec![1e-3; initial.len()],
            initial,
        }),
        prediction: None,
        basis: None,
        expected_loss: ValidatedLoss {
            expected: Expected::new(1.0, [1.0; 2].into_iter()),
            split: ValidationSplit::Training,
        },
        materials: Vec::new(),
    };
    Ok(Recipe {
        file: recipe_of(&learned, &options, "nothing")?,
        basis: None,
    })
}

/// What stands for a judgment that is not made.
pub(super) fn blank_evaluation(seeds: u64, materials: &[Box<dyn Material>]) -> Evaluation {
    let scores = Metrics {
        loss: 1.0,
        dssim: 1.0,
        l2: 1.0,
        psnr: 1.0,
        delta_e: 1.0,
    };
    let each = materials.iter().map(|material| MaterialMetrics {
        name: material.name().to_owned(),
        scores,
        predicted_loss: None,
    });
    Evaluation {
        scores,
        seeds,
        loss_spread: 0.0,
        materials: each.collect(),
    }
}
