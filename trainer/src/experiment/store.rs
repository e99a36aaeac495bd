//! What all experiments share: materials, recipes trained once, methods judged once.
//!
//! Everything that takes long is kept in a folder, under a name that says what it is. A run that
//! was stopped goes on from there, and experiments that need the same recipe train it once.

use std::cell::OnceCell;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::make_folders;
use glimpse_materials::loss::DIRECTIONS;
use glimpse_materials::{Material, Portion, Source};
use glimpse_trainer::evaluation::{Evaluator, Method, OPTIMUM_STEPS, Report};
use glimpse_trainer::render::Environment;
use glimpse_training::linear::{Columns, least_condition, principal_components};
use glimpse_training::meta;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::Checkpoints;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::{RecipeFile, recipe_of};
use serde::{Deserialize, Serialize};

use super::case::{Approach, Case, TrainingRun};
use super::circumstances::{MaterialSet, RunSettings};
pub(crate) use super::kept::{Evaluation, Recipe};
use super::kept::{keep, read_evaluation, with_extension};
use super::needed::{Needed, NotMade, Purpose, blank_evaluation, blank_recipe};

/// The folders of recipes and of judgments.
const RECIPES: &str = "recipes";
const SHEETS: &str = "sheets";

/// How often a training is saved.
const SAVED_EVERY: Duration = Duration::from_secs(10);

/// What an experiment is run with.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Where everything is written.
    pub(crate) out: PathBuf,
    /// Materials to train on.
    pub(crate) data: Source,
    /// How long to train, except by the paper's schedule.
    pub(crate) effort: Effort,
    /// How long to train by the paper's schedule.
    pub(crate) paper_effort: Effort,
    /// Seed of all random numbers.
    pub(crate) seed: u64,
    /// Repetitions of random methods.
    pub(crate) seeds: u64,
    /// What lights the spheres, in words.
    pub(crate) light: String,
}

impl Settings {
    /// The effort of trainings by a schedule.
    fn effort_of(&self, schedule: Schedule) -> Effort {
        match schedule {
            Schedule::Paper => self.paper_effort,
            Schedule::Joint | Schedule::Prior => self.effort,
        }
    }
}

/// The settings of a folder's experiments, as they are recorded in it. Work of other settings must not be
/// mixed with them.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Recorded {
    trainer: String,
    effort: recipe::Effort,
    paper_effort: recipe::Effort,
    seed: u64,
    seeds: u64,
    light: String,
    trained_on: Vec<String>,
    evaluated_on: Vec<String>,
    directions: usize,
}

/// Materials to judge on.
pub(crate) struct TestSet<'a> {
    /// The folder of their judgments, also part of names of tables.
    pub(crate) label: String,
    /// The name of their source.
    source: String,
    /// The materials.
    pub(crate) materials: &'a [Box<dyn Material>],
    judge: OnceCell<Evaluator<'a>>,
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
            judge: OnceCell::new(),
            environment,
        }
    }

    /// Their judge, who renders all of them when first asked.
    pub(crate) fn judge(&self) -> &Evaluator<'a> {
        self.judge
            .get_or_init(|| Evaluator::under(self.environment.clone(), self.materials))
    }
}

/// Trains, and shows how far it is.
pub(crate) type Train =
    dyn Fn(&Options, Vec<Box<dyn Material>>) -> anyhow::Result<meta::learned::Learned>;

/// The place where experiments are made.
pub(crate) struct Store<'a> {
    pub(crate) settings: Settings,
    /// What experiments are run for.
    pub(crate) purpose: Purpose,
    /// The materials that are judged.
    pub(crate) test: &'a TestSet<'a>,
    /// Other sources that are judged too.
    pub(crate) additional: &'a [TestSet<'a>],
    train: &'a Train,
    /// The number of materials to train on.
    training: usize,
    columns: OnceCell<Columns>,
}

impl<'a> Store<'a> {
    /// Opens the folder.
    ///
    /// # Errors
    /// If it holds work of other settings, which must not be mixed with this one.
    pub(crate) fn open(
        settings: Settings,
        purpose: Purpose,
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
        let recorded = Recorded {
            trainer: env!("CARGO_PKG_VERSION").into(),
            effort: settings.effort.into(),
            paper_effort: settings.paper_effort.into(),
            seed: settings.seed,
            seeds: settings.seeds,
            light: settings.light.clone(),
            trained_on: names(training),
            evaluated_on: names(test.materials),
            directions: DIRECTIONS,
        };
        if path.exists() {
            let found =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            if serde_json::from_slice(&found).ok().as_ref() != Some(&recorded) {
                bail!(
                    "{} holds experiments of other settings or materials ({} states which): give \
                     another --out, or remove it",
                    settings.out.display(),
                    path.display()
                );
            }
        } else if !matches!(purpose, Purpose::Listing(_)) {
            keep(&path, serde_json::to_string_pretty(&recorded)?.as_bytes())?;
        }
        Ok(Self {
            settings,
            purpose,
            test,
            additional,
            train,
            training: training.len(),
            columns: OnceCell::new(),
        })
    }

    /// The settings that results are found under: of methods trained by these schedules, judged on a set.
    pub(crate) fn circumstances(&self, set: &TestSet<'_>, schedules: &[Schedule]) -> RunSettings {
        let settings = &self.settings;
        let trainings = schedules.iter();
        RunSettings {
            trainings: trainings
                .map(|schedule| (*schedule, settings.effort_of(*schedule)))
                .collect(),
            seed: settings.seed,
            seeds: settings.seeds,
            training_set: MaterialSet {
                source: settings.data.label().to_owned(),
                materials: self.training,
            },
            test_set: MaterialSet {
                source: set.source.clone(),
                materials: set.materials.len(),
            },
        }
    }

    /// The files of a training: the recipe, the basis that Linear has beside it, the checkpoint.
    fn files(&self, training: &TrainingRun) -> [PathBuf; 3] {
        let path = self.settings.out.join(RECIPES).join(training.name());
        ["recipe", "basis", "checkpoint"].map(|kind| with_extension(&path, kind))
    }

    /// A trained recipe: the one kept, or a new one.
    ///
    /// Where that is not what the experiment is run for, something stands for one that is not there.
    pub(crate) fn recipe(&self, training: &TrainingRun) -> anyhow::Result<Recipe> {
        let [recipe, basis, checkpoint] = self.files(training);
        let name = format!("{RECIPES}/{}", training.name());
        let before = training
            .needs()
            .map(|needed| self.files(&needed)[0].clone());
        if let Purpose::Listing(notes) = &self.purpose {
            let mut outputs = vec![recipe.clone()];
            if training.model == ModelKind::Linear {
                // First: it is written first.
                outputs.insert(0, basis.clone());
            }
            notes.asked_for(&outputs);
            notes.add(Needed {
                is_done: outputs.iter().all(|path| path.exists()),
                name: name.clone(),
                inputs: before.iter().cloned().collect(),
                outputs,
                checkpoint: Some(checkpoint.clone()),
            });
        }
        let is_wanted = match &self.purpose {
            Purpose::Everything => true,
            Purpose::Only(wanted) => wanted.is(&name),
            Purpose::Listing(_) => false,
        };
        if recipe.exists() {
            let basis = match training.model {
                ModelKind::Linear => Some(
                    fs::read(&basis).with_context(|| format!("cannot read {}", basis.display()))?,
                ),
                _ => None,
            };
            return Recipe::of(RecipeFile::read(&recipe)?, basis.as_deref());
        }
        if !is_wanted && !self.purpose.judges() {
            return blank_recipe(training.samples);
        }
        let missing = match self.purpose {
            Purpose::Everything => None,
            _ if is_wanted => before.filter(|before| !before.exists()),
            _ => Some(recipe),
        };
        match missing {
            None => self.train(training),
            Some(path) => bail!("{} is needed first: make that before", path.display()),
        }
    }

    /// Trains a recipe, and keeps it.
    fn train(&self, training: &TrainingRun) -> anyhow::Result<Recipe> {
        let name = training.name();
        let [recipe, basis, checkpoint] = self.files(training);
        let mut materials = self.settings.data.load()?;
        if let Some((_, names)) = &training.only {
            materials.retain(|material| names.iter().any(|name| name == material.name()));
        }
        let seed = self.settings.seed.wrapping_add(training.repetition);
        let options = Options {
            portions: vec![Portion::whole(&self.settings.data, materials.len())],
            parts: training.parts.clone(),
            prior: training.prior,
            checkpoints: Some(Checkpoints {
                directory: checkpoint.clone(),
                every: SAVED_EVERY,
                resume: true,
            }),
            ..Options::new(
                training.model,
                training.samples,
                training.schedule,
                self.settings.effort_of(training.schedule),
                seed,
            )
        };
        let folder = self.settings.out.join(RECIPES);
        make_folders(&folder).with_context(|| format!("cannot write {}", checkpoint.display()))?;
        eprintln!("training {name}");
        let found = (self.train)(&options, materials)?;
        let file = recipe_of(&found, &options, self.settings.data.label())?;
        Checkpoint::remove(&checkpoint);
        if let Some(bytes) = &found.basis {
            // First: a recipe without its basis would be of no use.
            keep(&basis, bytes)?;
        }
        keep(&recipe, file.bytes())?;
        Recipe::of(file, found.basis.as_deref())
    }

    /// The basis of the training materials with so many components.
    fn basis(&self, components: usize) -> anyhow::Result<Basis> {
        let columns = match self.columns.get() {
            Some(columns) => columns,
            None => {
                let materials = self.settings.data.load()?;
                self.columns.get_or_init(|| Columns::new(&materials))
            }
        };
        let all: Vec<usize> = (0..columns.count()).collect();
        Ok(principal_components(columns, &all, components))
    }

    /// Where an experiment is not run to be made: takes note of the recipe that a case needs, and returns
    /// true.
    pub(crate) fn only_notes(&self, case: &Case) -> anyhow::Result<bool> {
        if self.purpose.judges() {
            return Ok(false);
        }
        if let Some(training) = TrainingRun::of(case) {
            self.recipe(&training)?;
        }
        Ok(true)
    }

    /// Makes a case's method, and hands it to `then`.
    pub(crate) fn with_method<T>(
        &self,
        case: &Case,
        then: impl FnOnce(&Method<'_>) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let Case {
            approach,
            model,
            samples,
            prior,
        } = *case;
        if let Some(training) = TrainingRun::of(case) {
            let learned = self.recipe(&training)?;
            let recipe = learned.file.recipe();
            return match approach {
                Approach::Meta(_) => then(&Method::meta(&recipe, learned.basis.as_ref())?),
                _ => then(&Method::ours(&recipe, learned.basis.as_ref())?),
            };
        }
        if !self.purpose.judges() {
            return Err(NotMade.into());
        }
        if model == ModelKind::Linear {
            let basis = self.basis(prior.components)?;
            let eta = prior
                .eta
                .context("Random, NJR15 and Optimum of Linear have a fixed eta")?;
            return then(&match approach {
                Approach::Njr15 => {
                    let pattern = least_condition(&basis, samples, self.settings.seed);
                    Method::linear_njr15(&basis, eta, pattern)
                }
                Approach::Optimum => Method::linear_optimum(&basis, eta),
                _ => Method::linear_random(&basis, eta, samples),
            });
        }
        then(&match approach {
            Approach::Optimum => Method::optimum(model, self.optimum_steps(model)),
            _ => Method::random(model, samples, INNER_STEPS),
        })
    }

    /// Steps of the method Optimum: for a quick look a tenth of them, where they take long.
    pub(crate) fn optimum_steps(&self, model: ModelKind) -> usize {
        match (self.settings.effort, model) {
            (Effort::Brief | Effort::Quick, ModelKind::Neural) => OPTIMUM_STEPS / 10,
            _ => OPTIMUM_STEPS,
        }
    }

    /// How well a case does on the materials that are judged.
    pub(crate) fn evaluation(&self, case: &Case) -> anyhow::Result<Evaluation> {
        self.evaluation_on(self.test, case)
    }

    /// The same on other materials.
    pub(crate) fn evaluation_on(
        &self,
        set: &TestSet<'_>,
        case: &Case,
    ) -> anyhow::Result<Evaluation> {
        self.kept_evaluation(set, &case.name(), self.settings.seeds, |judge| {
            self.with_method(case, judge)
        })
    }

    /// The evaluation kept under a name, or a new one: `make` is given a judge to hand a method to.
    pub(crate) fn kept_evaluation(
        &self,
        set: &TestSet<'_>,
        name: &str,
        seeds: u64,
        make: impl FnOnce(&dyn Fn(&Method<'_>) -> anyhow::Result<Report>) -> anyhow::Result<Report>,
    ) -> anyhow::Result<Evaluation> {
        let short = name;
        let name = format!("{SHEETS}/{}/{short}", set.label);
        let path = with_extension(&self.settings.out.join(&name), "json");
        let kept = read_evaluation(&path)?;
        if let Purpose::Listing(notes) = &self.purpose {
            notes.recipes();
            name_only(make)?;
            notes.add(Needed {
                name,
                inputs: notes.recipes(),
                outputs: vec![path.clone()],
                checkpoint: None,
                is_done: kept.is_some(),
            });
            return Ok(kept.unwrap_or_else(|| blank_evaluation(seeds, set.materials)));
        }
        let is_wanted = match &self.purpose {
            Purpose::Only(wanted) => wanted.is(&name),
            _ => true,
        };
        if let Some(kept) = kept {
            return Ok(kept);
        }
        if !is_wanted {
            // A recipe that it needs may be what is wanted.
            name_only(make)?;
            return Ok(blank_evaluation(seeds, set.materials));
        }
        let judge = |method: &Method<'_>| {
            eprintln!("judging {short} on {}", set.label);
            Ok(set.judge().judge(method, self.settings.seed, seeds)?)
        };
        let report = match &self.purpose {
            Purpose::Only(wanted) => wanted.judge(|| make(&judge)),
            _ => make(&judge),
        }?;
        let evaluation = Evaluation::from(report);
        keep(&path, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
        Ok(evaluation)
    }

    /// How glossy a material is: the ratio of its greatest to its median BRDF times cosine, at
    /// uniform valid directions.
    pub(crate) fn glossiness(&self, material: &dyn Material) -> f32 {
        const PLACES: usize = 4_096;
        let angles = glimpse_materials::sampling::uniform_valid(PLACES, self.settings.seed);
        let mut values: Vec<f32> = angles
            .into_iter()
            .map(|angles| {
                let at = glimpse_core::geometry::HalfDifference::from_angles(angles);
                material.brdf(angles).iter().sum::<f32>() * at.cos_theta_i()
            })
            .collect();
        values.sort_by(f32::total_cmp);
        let [median, greatest] = [PLACES / 2, PLACES - 1].map(|index| values[index]);
        greatest / median.max(1e-6)
    }

    /// Indices of materials, from the most diffuse to the most glossy.
    pub(crate) fn by_glossiness(&self, materials: &[Box<dyn Material>]) -> Vec<usize> {
        let ratios: Vec<f32> = materials
            .iter()
            .map(|material| self.glossiness(&**material))
            .collect();
        let mut order: Vec<usize> = (0..ratios.len()).collect();
        order.sort_by(|a, b| ratios[*a].total_cmp(&ratios[*b]));
        order
    }
}

/// Applies no method, so that only what it needs is asked for.
fn name_only(
    make: impl FnOnce(&dyn Fn(&Method<'_>) -> anyhow::Result<Report>) -> anyhow::Result<Report>,
) -> anyhow::Result<()> {
    match make(&|_| Err(NotMade.into())) {
        Err(error) if !error.is::<NotMade>() => Err(error),
        _ => Ok(()),
    }
}
