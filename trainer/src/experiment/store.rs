//! What all experiments share: materials, recipes trained once, methods judged once.
//!
//! Everything that takes long is kept in a folder, under a name that says what it is. A run that
//! was stopped goes on from there, and experiments that need the same recipe train it once.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use glimpse_core::model::ModelKind;
use glimpse_trainer::evaluation::{
    DIRECTIONS, Judge, MaterialScores, Method, OPTIMUM_STEPS, Verdict,
};
use glimpse_trainer::export::{RecipeFile, recipe_of};
use glimpse_trainer::files::write_whole;
use glimpse_trainer::linear::{Basis, Columns, least_condition};
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::meta;
use glimpse_trainer::meta::checkpoint::Checkpoint;
use glimpse_trainer::meta::options::Options;
use glimpse_trainer::meta::outer::Checkpoints;
use glimpse_trainer::meta::plan::Effort;
use glimpse_trainer::meta::run::INNER_STEPS;
use glimpse_trainer::metrics::Scores;
use glimpse_trainer::render::Environment;
use serde::{Deserialize, Serialize};

use super::case::{Approach, Case, TrainingRun};

/// How often a training is saved.
const SAVED_EVERY: Duration = Duration::from_secs(10);

/// What an experiment is run with.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Where everything is written.
    pub(crate) out: PathBuf,
    /// Materials to train on.
    pub(crate) data: Source,
    /// How long to train.
    pub(crate) effort: Effort,
    /// Seed of all random numbers.
    pub(crate) seed: u64,
    /// Repetitions of random methods.
    pub(crate) seeds: u64,
    /// What lights the spheres, in words.
    pub(crate) light: String,
}

/// Materials to judge on.
pub(crate) struct TestSet<'a> {
    /// What they are called in the names of files and in tables.
    pub(crate) label: String,
    /// The materials.
    pub(crate) materials: &'a [Box<dyn Material>],
    judge: OnceCell<Judge<'a>>,
    environment: &'a Environment,
}

impl<'a> TestSet<'a> {
    pub(crate) fn new(
        label: String,
        materials: &'a [Box<dyn Material>],
        environment: &'a Environment,
    ) -> Self {
        Self {
            label,
            materials,
            judge: OnceCell::new(),
            environment,
        }
    }

    /// Their judge, who renders all of them when first asked.
    pub(crate) fn judge(&self) -> &Judge<'a> {
        self.judge
            .get_or_init(|| Judge::under(self.environment.clone(), self.materials))
    }
}

/// A trained recipe, and the basis of one of Linear.
pub(crate) struct Learned {
    pub(crate) file: RecipeFile,
    pub(crate) basis: Option<Basis>,
}

/// Trains, and shows how far it is.
pub(crate) type Train =
    dyn Fn(&Options, Vec<Box<dyn Material>>) -> anyhow::Result<meta::learned::Learned>;

/// How well a method did, as it is kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Evaluation {
    /// Means over the materials.
    #[serde(flatten)]
    pub(crate) scores: Scores,
    /// How many seeds were averaged over.
    pub(crate) seeds: u64,
    /// Standard deviation of the mean loss from seed to seed.
    pub(crate) loss_spread: f64,
    /// Each material.
    pub(crate) materials: Vec<MaterialScores>,
}

impl From<Verdict> for Evaluation {
    fn from(verdict: Verdict) -> Self {
        let Verdict {
            scores,
            seeds,
            loss_spread,
            materials,
            ..
        } = verdict;
        Self {
            scores,
            seeds,
            loss_spread,
            materials,
        }
    }
}

/// The place where experiments are made.
pub(crate) struct Store<'a> {
    pub(crate) settings: Settings,
    /// The materials that are judged.
    pub(crate) test: &'a TestSet<'a>,
    /// Other sources that are judged too.
    pub(crate) additional: &'a [TestSet<'a>],
    train: &'a Train,
    columns: OnceCell<Columns>,
}

impl<'a> Store<'a> {
    /// Opens the folder.
    ///
    /// # Errors
    /// If it holds work of other settings, which must not be mixed with this one.
    pub(crate) fn open(
        settings: Settings,
        training: &[Box<dyn Material>],
        test: &'a TestSet<'a>,
        additional: &'a [TestSet<'a>],
        train: &'a Train,
    ) -> anyhow::Result<Self> {
        let path = settings.out.join("settings.txt");
        let names = |materials: &[Box<dyn Material>]| {
            let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
            names.join(" ")
        };
        let words = format!(
            "{}\neffort {:?}\nseed {}\nseeds of random methods {}\nlight {}\ntrained on {}\njudged on {}\n\
             at {DIRECTIONS} fixed directions\n",
            concat!("glimpse-trainer ", env!("CARGO_PKG_VERSION")),
            settings.effort,
            settings.seed,
            settings.seeds,
            settings.light,
            names(training),
            names(test.materials),
        );
        if path.exists() {
            let found = fs::read_to_string(&path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            if found != words {
                bail!(
                    "{} holds experiments of other settings or materials ({} tells which): give \
                     another --out, or remove it",
                    settings.out.display(),
                    path.display()
                );
            }
        } else {
            keep(&path, words.as_bytes())?;
        }
        Ok(Self {
            settings,
            test,
            additional,
            train,
            columns: OnceCell::new(),
        })
    }

    /// A trained recipe: the one kept, or a new one.
    pub(crate) fn recipe(&self, training: &TrainingRun) -> anyhow::Result<Learned> {
        let name = training.name();
        let path = self.settings.out.join("recipes").join(&name);
        let [recipe, basis, checkpoint] =
            ["recipe", "basis", "checkpoint"].map(|kind| with_extension(&path, kind));
        if recipe.exists() {
            let basis = match training.model {
                ModelKind::Linear => Some(
                    fs::read(&basis).with_context(|| format!("cannot read {}", basis.display()))?,
                ),
                _ => None,
            };
            return learned(RecipeFile::read(&recipe)?, basis.as_deref());
        }
        let mut materials = self.settings.data.load()?;
        if let Some((_, names)) = &training.only {
            materials.retain(|material| names.iter().any(|name| name == material.name()));
        }
        let seed = self.settings.seed.wrapping_add(training.repetition);
        let options = Options {
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
                self.settings.effort,
                seed,
            )
        };
        let folder = checkpoint.parent().unwrap_or(Path::new(""));
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot write {}", checkpoint.display()))?;
        eprintln!("training {name}");
        let found = (self.train)(&options, materials)?;
        let file = recipe_of(&found, &options, self.settings.data.label())?;
        Checkpoint::remove(&checkpoint);
        if let Some(bytes) = found.basis() {
            // First: a recipe without its basis would be of no use.
            keep(&basis, bytes)?;
        }
        keep(&recipe, file.bytes())?;
        learned(file, found.basis())
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
        Ok(Basis::new(columns, &all, components))
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
        if matches!(approach, Approach::Ours | Approach::Meta) {
            let learned = self.recipe(&TrainingRun::of(case))?;
            let recipe = learned.file.recipe()?;
            return match approach {
                Approach::Ours => then(&Method::ours(&recipe, learned.basis.as_ref())?),
                _ => then(&Method::meta(&recipe, learned.basis.as_ref())?),
            };
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
        make: impl FnOnce(&dyn Fn(&Method<'_>) -> anyhow::Result<Verdict>) -> anyhow::Result<Verdict>,
    ) -> anyhow::Result<Evaluation> {
        let folder = self.settings.out.join("sheets").join(&set.label);
        let path = with_extension(&folder.join(name), "json");
        if path.exists() {
            let text = fs::read_to_string(&path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            return serde_json::from_str(&text)
                .with_context(|| format!("{} is damaged: remove it", path.display()));
        }
        let verdict = make(&|method| {
            eprintln!("judging {name} on {}", set.label);
            Ok(set.judge().judge(method, self.settings.seed, seeds)?)
        })?;
        let evaluation = Evaluation::from(verdict);
        keep(&path, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
        Ok(evaluation)
    }

    /// How glossy a material is: the ratio of its greatest to its median BRDF times cosine, at
    /// uniform valid directions.
    pub(crate) fn glossiness(&self, material: &dyn Material) -> f32 {
        const PLACES: usize = 4_096;
        let angles = glimpse_trainer::sampling::uniform_valid(PLACES, self.settings.seed);
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

fn learned(file: RecipeFile, basis: Option<&[u8]>) -> anyhow::Result<Learned> {
    let basis = basis
        .map(Basis::from_bytes)
        .transpose()
        .map_err(|what| anyhow!("the basis: {what}"))?;
    Ok(Learned { file, basis })
}

/// Adds an extension; what looks like one in the name stays.
fn with_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// Writes a file of the experiments' folder, which is there, whole or not at all.
pub(super) fn keep(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder)
        .and_then(|()| write_whole(path, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}
