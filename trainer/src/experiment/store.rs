//! The store that all experiments share: materials, trained recipes and evaluations.
//!
//! Recipes and evaluations are stored in the output folder under descriptive names. An interrupted run continues from
//! them, and experiments that use the same recipe train it once.

use std::cell::OnceCell;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::loss::DIRECTIONS;
use glimpse_materials::{Material, Source, SourceShare};
use glimpse_trainer::evaluation::{Evaluator, Method, OPTIMUM_STEPS, Report};
use glimpse_trainer::render::Environment;
use glimpse_training::linear::{Columns, min_condition_pattern, principal_components};
use glimpse_training::meta;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::options::{CompletionOptions, Options};
use glimpse_training::meta::outer::CheckpointOptions;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::{RecipeFile, pack_recipe};
use serde::{Deserialize, Serialize};

use super::case::{Approach, Case, TrainingRun};
use super::run_mode::{NotEvaluated, PlannedCell, RunMode, blank_evaluation, blank_recipe};
use super::run_settings::{MaterialSet, RunSettings};
pub(crate) use super::stored::{Evaluation, TrainedRecipe};
use super::stored::{append_extension, read_evaluation, write_file};

/// The folders of recipes and of evaluations.
const RECIPES: &str = "recipes";
const EVALUATIONS: &str = "sheets";

/// The interval between checkpoints of a training.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(10);

/// The settings of a run.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Output folder.
    pub(crate) out: PathBuf,
    /// Materials to train on.
    pub(crate) data: Source,
    /// Effort of trainings, except with the paper's schedule.
    pub(crate) effort: Effort,
    /// Effort of trainings with the paper's schedule.
    pub(crate) paper_effort: Effort,
    /// Seed of all random numbers.
    pub(crate) seed: u64,
    /// Number of repetitions of random methods.
    pub(crate) seeds: u64,
    /// Description of the environment that lights the spheres.
    pub(crate) light: String,
}

impl Settings {
    /// Returns the effort of trainings with a schedule.
    fn effort_for(&self, schedule: Schedule) -> Effort {
        match schedule {
            Schedule::Paper => self.paper_effort,
            Schedule::Joint | Schedule::Prior => self.effort,
        }
    }
}

/// The settings that are recorded in the output folder. A folder with other settings is rejected.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct RecordedSettings {
    trainer: String,
    effort: Effort,
    paper_effort: Effort,
    seed: u64,
    seeds: u64,
    light: String,
    trained_on: Vec<String>,
    evaluated_on: Vec<String>,
    directions: usize,
}

/// Materials to evaluate on.
pub(crate) struct TestSet<'a> {
    /// Name of the set's folder of evaluations, which is also a part of table names.
    pub(crate) label: String,
    /// Name of the source.
    source: String,
    /// The materials.
    pub(crate) materials: &'a [Box<dyn Material>],
    evaluator: OnceCell<Evaluator<'a>>,
    environment: &'a Environment,
}

impl<'a> TestSet<'a> {
    pub(crate) fn new(
        label: String,
        source: &Source,
        materials: &'a [Box<dyn Material>],
        environment: &'a Environment,
    ) -> Self {
        Self {
            label,
            source: source.label().to_owned(),
            materials,
            evaluator: OnceCell::new(),
            environment,
        }
    }

    /// Returns the evaluator; the first call renders all materials.
    pub(crate) fn evaluator(&self) -> &Evaluator<'a> {
        self.evaluator
            .get_or_init(|| Evaluator::with_environment(self.environment.clone(), self.materials))
    }
}

/// A function that trains a recipe and reports progress.
pub(crate) type Train =
    dyn Fn(&Options, Vec<Box<dyn Material>>) -> anyhow::Result<meta::learned::LearnedRecipe>;

/// The store of recipes and evaluations.
pub(crate) struct Store<'a> {
    pub(crate) settings: Settings,
    /// Mode of the run.
    pub(crate) mode: RunMode,
    /// Materials to evaluate on.
    pub(crate) test: &'a TestSet<'a>,
    /// Test sets of the option --additional.
    pub(crate) additional: &'a [TestSet<'a>],
    train: &'a Train,
    /// Number of materials to train on.
    training_count: usize,
    /// Columns of the training materials, for the basis of Linear.
    columns: OnceCell<Columns>,
}

impl<'a> Store<'a> {
    /// Opens the output folder.
    ///
    /// # Errors
    /// If the folder has results of other settings, or a file cannot be read or written.
    pub(crate) fn open(
        settings: Settings,
        mode: RunMode,
        training: &[Box<dyn Material>],
        test: &'a TestSet<'a>,
        additional: &'a [TestSet<'a>],
        train: &'a Train,
    ) -> anyhow::Result<Self> {
        let path = settings.out.join("settings.json");
        let names = |materials: &[Box<dyn Material>]| {
            let names = materials.iter().map(|material| material.name().to_owned());
            names.collect()
        };
        let recorded = RecordedSettings {
            trainer: env!("CARGO_PKG_VERSION").into(),
            effort: settings.effort,
            paper_effort: settings.paper_effort,
            seed: settings.seed,
            seeds: settings.seeds,
            light: settings.light.clone(),
            trained_on: names(training),
            evaluated_on: names(test.materials),
            directions: DIRECTIONS,
        };
        if path.exists() {
            let existing =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            if serde_json::from_slice(&existing).ok().as_ref() != Some(&recorded) {
                bail!(
                    "{} has results of other settings or materials, which are in {}: give another \
                     --out, or remove the folder",
                    settings.out.display(),
                    path.display()
                );
            }
        } else if !matches!(mode, RunMode::List(_)) {
            write_file(&path, serde_json::to_string_pretty(&recorded)?.as_bytes())?;
        }
        Ok(Self {
            settings,
            mode,
            test,
            additional,
            train,
            training_count: training.len(),
            columns: OnceCell::new(),
        })
    }

    /// Returns the settings of results: methods that are trained with these schedules and evaluated on a test set.
    pub(crate) fn run_settings(&self, set: &TestSet<'_>, schedules: &[Schedule]) -> RunSettings {
        let settings = &self.settings;
        let trainings = schedules.iter();
        RunSettings {
            trainings: trainings
                .map(|schedule| (*schedule, settings.effort_for(*schedule)))
                .collect(),
            seed: settings.seed,
            seeds: settings.seeds,
            training_set: MaterialSet {
                source: settings.data.label().to_owned(),
                materials: self.training_count,
            },
            test_set: MaterialSet {
                source: set.source.clone(),
                materials: set.materials.len(),
            },
        }
    }

    /// Returns the paths of a training: the recipe, the basis of Linear, and the checkpoint.
    fn training_files(&self, training: &TrainingRun) -> [PathBuf; 3] {
        let path = self.settings.out.join(RECIPES).join(training.name());
        ["recipe", "basis", "checkpoint"].map(|kind| append_extension(&path, kind))
    }

    /// Returns the stored recipe of a training, or trains it.
    ///
    /// If the run's mode excludes this training, an untrained recipe is a [blank](blank_recipe).
    ///
    /// # Errors
    /// If the target cell requires an untrained recipe, training fails, or a file cannot be read or written.
    pub(crate) fn recipe(&self, training: &TrainingRun) -> anyhow::Result<TrainedRecipe> {
        let [recipe, basis, checkpoint] = self.training_files(training);
        let name = format!("{RECIPES}/{}", training.name());
        let prerequisite = training
            .prerequisite()
            .map(|training| self.training_files(&training)[0].clone());
        if let RunMode::List(plan) = &self.mode {
            let mut outputs = vec![recipe.clone()];
            if training.model == ModelKind::Linear {
                // The basis is written first.
                outputs.insert(0, basis.clone());
            }
            plan.add_recipe(&outputs);
            plan.add(PlannedCell {
                is_done: outputs.iter().all(|path| path.exists()),
                name: name.clone(),
                inputs: prerequisite.iter().cloned().collect(),
                outputs,
                checkpoint: Some(checkpoint.clone()),
            });
        }
        let is_selected = match &self.mode {
            RunMode::All => true,
            RunMode::Only(target) => target.mark_if_named(&name),
            RunMode::List(_) => false,
        };
        if recipe.exists() {
            let basis = match training.model {
                ModelKind::Linear => Some(
                    fs::read(&basis).with_context(|| format!("cannot read {}", basis.display()))?,
                ),
                _ => None,
            };
            return TrainedRecipe::new(RecipeFile::read(&recipe)?, basis.as_deref());
        }
        if !is_selected && !self.mode.evaluates() {
            return blank_recipe(training.samples);
        }
        let missing = match self.mode {
            RunMode::All => None,
            _ if is_selected => prerequisite.filter(|path| !path.exists()),
            _ => Some(recipe),
        };
        match missing {
            None => self.train(training),
            Some(path) => bail!(
                "{} does not exist and is required: run its cell first",
                path.display()
            ),
        }
    }

    /// Trains a recipe and stores it.
    fn train(&self, training: &TrainingRun) -> anyhow::Result<TrainedRecipe> {
        let name = training.name();
        let [recipe, basis, checkpoint] = self.training_files(training);
        let mut materials = self.settings.data.load()?;
        if let Some((_, names)) = &training.subset {
            materials.retain(|material| names.iter().any(|name| name == material.name()));
        }
        let seed = self.settings.seed.wrapping_add(training.repetition);
        let defaults = Options::new(
            training.model,
            training.samples,
            training.schedule,
            self.settings.effort_for(training.schedule),
            seed,
        );
        let options = Options {
            completion_options: CompletionOptions {
                scan: training.motion_budget(),
                ..defaults.completion_options
            },
            source_shares: vec![SourceShare::single(&self.settings.data, materials.len())],
            parts: training.parts,
            pretrained: training.pretrained.clone(),
            prior: training.prior,
            checkpoints: Some(CheckpointOptions {
                directory: checkpoint.clone(),
                interval: CHECKPOINT_INTERVAL,
                resume: true,
            }),
            ..defaults
        };
        let folder = self.settings.out.join(RECIPES);
        fs::create_dir_all(&folder)
            .with_context(|| format!("cannot write {}", checkpoint.display()))?;
        eprintln!("training {name}");
        let learned = (self.train)(&options, materials)?;
        let file = pack_recipe(&learned, &options, self.settings.data.label())?;
        Checkpoint::remove(&checkpoint);
        if let Some(bytes) = &learned.basis {
            // The basis is written first, because a recipe without its basis is unusable.
            write_file(&basis, bytes)?;
        }
        write_file(&recipe, file.bytes())?;
        TrainedRecipe::new(file, learned.basis.as_deref())
    }

    /// Returns the first `components` principal components of the training materials.
    fn basis(&self, components: usize) -> anyhow::Result<Basis> {
        let columns = match self.columns.get() {
            Some(columns) => columns,
            None => {
                let materials = self.settings.data.load()?;
                self.columns.get_or_init(|| Columns::new(&materials))
            }
        };
        let all_columns: Vec<usize> = (0..columns.count()).collect();
        Ok(principal_components(columns, &all_columns, components))
    }

    /// Returns true if this run does not evaluate methods. It then only records the recipe that a case requires.
    pub(crate) fn record_only(&self, case: &Case) -> anyhow::Result<bool> {
        if self.mode.evaluates() {
            return Ok(false);
        }
        if let Some(training) = TrainingRun::for_case(case) {
            self.recipe(&training)?;
        }
        Ok(true)
    }

    /// Passes the method of a case to `use_method`, and returns its result.
    pub(crate) fn with_method<T>(
        &self,
        case: &Case,
        use_method: impl FnOnce(&Method<'_>) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let Case {
            approach,
            model,
            samples,
            prior,
            motion: _,
        } = *case;
        if let Some(training) = TrainingRun::for_case(case) {
            let learned = self.recipe(&training)?;
            let recipe = learned.file.recipe();
            return match approach {
                Approach::Meta(_) => use_method(&Method::meta(&recipe, learned.basis.as_ref())?),
                _ => use_method(&Method::ours(&recipe, learned.basis.as_ref())?),
            };
        }
        if !self.mode.evaluates() {
            return Err(NotEvaluated.into());
        }
        if model == ModelKind::Linear {
            let basis = self.basis(prior.components)?;
            let eta = prior
                .eta
                .context("Random, NJR15 and Optimum of Linear need a fixed eta: set Prior::eta")?;
            return use_method(&match approach {
                Approach::Njr15 => {
                    let pattern = min_condition_pattern(&basis, samples, self.settings.seed);
                    Method::linear_njr15(&basis, eta, pattern)
                }
                Approach::Optimum => Method::linear_optimum(&basis, eta),
                _ => Method::linear_random(&basis, eta, samples),
            });
        }
        use_method(&match approach {
            Approach::Optimum => Method::optimum(model, self.optimum_steps(model)),
            _ => Method::random(model, samples, INNER_STEPS),
        })
    }

    /// Returns the number of steps of the method Optimum. With effort brief or quick, Neural has a tenth of the steps.
    pub(crate) fn optimum_steps(&self, model: ModelKind) -> usize {
        match (self.settings.effort, model) {
            (Effort::Brief | Effort::Quick, ModelKind::Neural) => OPTIMUM_STEPS / 10,
            _ => OPTIMUM_STEPS,
        }
    }

    /// Returns the evaluation of a case on the test set.
    pub(crate) fn evaluation(&self, case: &Case) -> anyhow::Result<Evaluation> {
        self.evaluation_on(self.test, case)
    }

    /// Returns the evaluation of a case on any test set.
    pub(crate) fn evaluation_on(
        &self,
        set: &TestSet<'_>,
        case: &Case,
    ) -> anyhow::Result<Evaluation> {
        self.cached_evaluation(set, &case.name(), self.settings.seeds, |evaluate| {
            self.with_method(case, evaluate)
        })
    }

    /// Returns the evaluation that is stored under a name, or computes and stores it. `compute` receives a function
    /// that evaluates a method.
    pub(crate) fn cached_evaluation(
        &self,
        set: &TestSet<'_>,
        name: &str,
        seeds: u64,
        compute: impl FnOnce(&dyn Fn(&Method<'_>) -> anyhow::Result<Report>) -> anyhow::Result<Report>,
    ) -> anyhow::Result<Evaluation> {
        let method_name = name;
        let name = format!("{EVALUATIONS}/{}/{method_name}", set.label);
        let path = append_extension(&self.settings.out.join(&name), "json");
        let stored = read_evaluation(&path)?;
        if let RunMode::List(plan) = &self.mode {
            plan.take_recipes();
            record_requirements(compute)?;
            plan.add(PlannedCell {
                name,
                inputs: plan.take_recipes(),
                outputs: vec![path.clone()],
                checkpoint: None,
                is_done: stored.is_some(),
            });
            return Ok(stored.unwrap_or_else(|| blank_evaluation(seeds, set.materials)));
        }
        let is_selected = match &self.mode {
            RunMode::Only(target) => target.mark_if_named(&name),
            _ => true,
        };
        if let Some(stored) = stored {
            return Ok(stored);
        }
        if !is_selected {
            // The target may be a recipe that this evaluation requires.
            record_requirements(compute)?;
            return Ok(blank_evaluation(seeds, set.materials));
        }
        let evaluate = |method: &Method<'_>| {
            eprintln!("evaluating {method_name} on {}", set.label);
            Ok(set
                .evaluator()
                .evaluate(method, self.settings.seed, seeds)?)
        };
        let report = match &self.mode {
            RunMode::Only(target) => target.evaluate(|| compute(&evaluate)),
            _ => compute(&evaluate),
        }?;
        let evaluation = Evaluation::from(report);
        write_file(&path, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
        Ok(evaluation)
    }
}

/// Runs `compute` without evaluating a method, so that it only requests its recipes.
fn record_requirements(
    compute: impl FnOnce(&dyn Fn(&Method<'_>) -> anyhow::Result<Report>) -> anyhow::Result<Report>,
) -> anyhow::Result<()> {
    match compute(&|_| Err(NotEvaluated.into())) {
        Err(error) if !error.is::<NotEvaluated>() => Err(error),
        _ => Ok(()),
    }
}
