//! The store that all experiments share: materials, trained recipes and evaluations.
//!
//! Recipes and evaluations are stored in the output folder under descriptive names. An interrupted run continues from
//! them, and experiments that use the same recipe train it once.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::{Args, value_parser};
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::{Angles, Arms};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::{
    Adaptive, EvaluationReport, Evaluator, LINEAR_OPTIMUM_DIRECTIONS, Method, OPTIMUM_STEPS,
    SampleDirections,
};
use glimpse_fitting::choice::Choice;
use glimpse_fitting::linear::Candidates;
use glimpse_fitting::measurement::{NamedRecipe, ReadingSet};
use glimpse_fitting::recipe::options::{
    Effort, PretrainedInit, Schedule, TrainedParts, TrainingOptions,
};
use glimpse_fitting::route::{Position, SpeedArgs, TimedMachine};
use glimpse_materials::loss::DIRECTIONS;
use glimpse_materials::sampling::{MeanBrdf, uniform_valid};
use glimpse_materials::{Identity, Material, Source, SourceShare};
use glimpse_training::linear::{Columns, min_condition_pattern, principal_components};
use glimpse_training::run::INNER_STEPS;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::case::{Approach, Case, MOTION_SPEED, REFINEMENT_STEPS, Variation};
use super::glossiness::split_by_glossiness;
use crate::progress::interrupted;
use crate::report::write_file;
use crate::training::train_to_file;

/// The message after Ctrl-C.
const STOPPED: &str = "stopped: repeat the command to continue";

/// The settings of a run.
#[derive(Args, Clone, Debug)]
pub(crate) struct Settings {
    /// Training materials
    #[arg(long, value_name = "SOURCE", default_value = "procedural:100")]
    pub(crate) data: Source,
    /// Output folder
    #[arg(long, short, default_value = "paper")]
    pub(crate) out: PathBuf,
    /// Length of each training with the schedule `prior`
    #[arg(long, value_enum, default_value_t = Effort::Quick)]
    pub(crate) effort: Effort,
    /// Length of each training with the schedule `paper` [default: that of --effort]
    #[arg(long, value_name = "EFFORT", value_enum)]
    pub(crate) paper_effort: Option<Effort>,
    /// Number of repetitions of random methods, 1 to 10000
    #[arg(long, default_value_t = 5, value_parser = value_parser!(u64).range(1..=10_000))]
    pub(crate) seeds: u64,
    /// Seed of all random numbers.
    #[arg(skip)]
    pub(crate) seed: u64,
}

impl Settings {
    /// Returns the effort of trainings with a schedule.
    pub(super) fn effort_for(&self, schedule: Schedule) -> Effort {
        match schedule {
            Schedule::Paper => self.paper_effort.unwrap_or(self.effort),
            Schedule::Prior => self.effort,
        }
    }
}

/// Materials to evaluate on.
pub(crate) struct TestSet<'a> {
    /// Name of the set's folder of evaluations, which is also a part of table names.
    pub(super) label: String,
    /// Name of the source.
    source: String,
    /// The materials.
    pub(super) materials: &'a [Box<dyn Material>],
    evaluator: OnceCell<Evaluator<'a>>,
}

impl<'a> TestSet<'a> {
    pub(crate) fn new(label: String, source: &Source, materials: &'a [Box<dyn Material>]) -> Self {
        Self {
            label,
            source: source.label().to_owned(),
            materials,
            evaluator: OnceCell::new(),
        }
    }

    /// Returns the evaluator; the first call renders all materials.
    pub(super) fn evaluator(&self) -> &Evaluator<'a> {
        self.evaluator
            .get_or_init(|| Evaluator::new(self.materials))
    }
}

/// The store of recipes and evaluations.
pub(crate) struct Store<'a> {
    pub(super) settings: Settings,
    /// The test set, followed by those of the option --additional.
    pub(super) sets: &'a [TestSet<'a>],
    /// Number of materials to train on.
    training_count: usize,
    /// Columns of the training materials, for the basis of Linear.
    columns: OnceCell<Columns>,
    mean_brdf: OnceCell<MeanBrdf>,
}

impl<'a> Store<'a> {
    /// Opens the output folder, and records the settings and the contents of all materials in it.
    ///
    /// # Errors
    /// If the folder has results of other settings or materials, or a file cannot be read or written.
    pub(crate) fn open(
        settings: Settings,
        training: &[Box<dyn Material>],
        sets: &'a [TestSet<'a>],
    ) -> anyhow::Result<Self> {
        let identities = |materials: &[Box<dyn Material>]| {
            let identities = materials.iter().map(|material| Identity::new(&**material));
            json!(identities.collect::<Vec<_>>())
        };
        let recorded = json!({
            "trainer": env!("CARGO_PKG_VERSION"),
            "effort": settings.effort,
            "paper_effort": settings.effort_for(Schedule::Paper),
            "seed": settings.seed,
            "seeds": settings.seeds,
            "trained_on": identities(training),
            "directions": DIRECTIONS,
        });
        require_recorded(&settings.out.join("settings.json"), &recorded)?;
        for set in sets {
            let path = format!("sheets/{}/materials.json", set.label);
            require_recorded(&settings.out.join(path), &identities(set.materials))?;
        }
        Ok(Self {
            settings,
            sets,
            training_count: training.len(),
            columns: OnceCell::new(),
            mean_brdf: OnceCell::new(),
        })
    }

    /// Returns the largest number of components of the training columns, three for each material. Subtracting the mean leaves
    /// one fewer.
    pub(super) fn max_components(&self) -> usize {
        (3 * self.training_count).saturating_sub(1).max(1)
    }

    /// Describes the settings of an experiment on a test set.
    pub(super) fn describe_settings(&self, set: &TestSet<'_>, cases: &[Case]) -> String {
        let settings = &self.settings;
        let mut text = String::new();
        for schedule in [Schedule::Paper, Schedule::Prior] {
            let mut schedules = cases.iter().map(|case| case.schedule());
            if !schedules.any(|other| other == Some(schedule)) {
                continue;
            }
            let effort = settings.effort_for(schedule);
            text += &format!("Schedule {}: effort {}", schedule.name(), effort.name());
            text += &match (schedule, effort.paper_step_divisor()) {
                (Schedule::Paper, 1) => ", all of the paper's steps. ".to_owned(),
                (Schedule::Paper, divisor) => format!(", 1/{divisor} of the paper's steps. "),
                _ => ". ".to_owned(),
            };
        }
        text + &format!(
            "Seed {}; random directions are drawn {} times. Training set: {} ({} materials). Test set: {} ({} materials).",
            settings.seed,
            settings.seeds,
            settings.data.label(),
            self.training_count,
            set.source,
            set.materials.len(),
        )
    }

    /// Returns the stored recipe that a case uses, with its basis, or trains it. `trained` is the result of
    /// [`Case::trained`].
    pub(super) fn recipe(&self, trained: &Case) -> anyhow::Result<NamedRecipe> {
        let path = format!("recipes/{}.recipe", trained.name());
        let path = self.settings.out.join(path);
        if !path.exists() {
            self.train(trained, &path)?;
        }
        Ok(NamedRecipe::read(&path)?)
    }

    fn train(&self, case: &Case, path: &Path) -> anyhow::Result<()> {
        let mut materials = self.settings.data.load()?;
        let seed = self.settings.seed;
        let schedule = case.schedule().context("a case without recipe")?;
        let effort = self.settings.effort_for(schedule);
        let mut options = TrainingOptions::new(case.model, case.samples, schedule, effort, seed);
        if schedule == Schedule::Paper {
            options.bases = case.components;
        }
        match case.variation {
            Variation::Seed(number) => options.seed = seed.wrapping_add(number),
            Variation::Twice => options.parts = TrainedParts::AllTwice,
            Variation::PatternOf(subset) => {
                let names = split_by_glossiness(&materials, seed, subset);
                materials.retain(|material| names.iter().any(|name| name == material.name()));
                let pretrained = self.descent(&case.with(Variation::None))?;
                options.parts = TrainedParts::PatternOnly(Some(pretrained));
            }
            Variation::Within(seconds) => {
                options.scan_seconds = Some(f64::from(seconds));
                options.speeds = SpeedArgs {
                    speed: Some(Arms::from_array([MOTION_SPEED; 4])),
                    settle: Some(0.0),
                };
            }
            _ => {}
        }
        options.source_shares = vec![SourceShare::single(&self.settings.data, materials.len())];
        let folder = self.settings.out.join("recipes");
        fs::create_dir_all(&folder)
            .with_context(|| format!("cannot write {}", folder.display()))?;
        eprintln!("training {}", case.name());
        let data = self.settings.data.label();
        let outcome = train_to_file(&options, materials, true, data, path);
        // After Ctrl-C, training has saved its state and ends with an error.
        ensure!(!interrupted(), STOPPED);
        outcome.map(drop)
    }

    /// Returns the initial parameters and step sizes of a training.
    fn descent(&self, trained: &Case) -> anyhow::Result<PretrainedInit> {
        let named = self.recipe(trained)?;
        let recipe = named.file.recipe();
        let Estimator::Sgd(sgd) = recipe.estimator() else {
            bail!(
                "{} is not fitted by descent: remove it to train it again",
                named.name
            );
        };
        Ok(PretrainedInit {
            initial: sgd.initial.iter().collect(),
            step_sizes: sgd.step_sizes.iter().collect(),
        })
    }

    /// Returns a value that is computed once from the training materials.
    fn of_training<'c, T>(
        &self,
        cell: &'c OnceCell<T>,
        compute: fn(&[Box<dyn Material>]) -> T,
    ) -> anyhow::Result<&'c T> {
        if let Some(value) = cell.get() {
            return Ok(value);
        }
        let materials = self.settings.data.load()?;
        Ok(cell.get_or_init(|| compute(&materials)))
    }

    /// Passes the method of a case to `use_method`, and returns its result.
    pub(super) fn with_method<T>(
        &self,
        case: &Case,
        use_method: impl FnOnce(Method<'_>) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let use_method = |method: Method<'_>| match case.variation {
            Variation::Refined => use_method(method.with_refinement(REFINEMENT_STEPS)),
            _ => use_method(method),
        };
        let Some(trained) = case.trained() else {
            return self.with_untrained(case, use_method);
        };
        let seed = self.settings.seed;
        let mut named = self.recipe(&trained)?;
        if let Variation::Readings(sets, _) = case.variation {
            named = named.at_geometries(&ReadingSet::geometries(sets, 0.0))?;
        }
        let (recipe, basis) = (named.file.recipe(), named.basis.as_deref());
        let at = |directions| Method::at_directions(case.method(), &recipe, basis, directions);
        let method = match (case.variation, case.approach) {
            (Variation::Importance, _) => {
                let mean_brdf = self.of_training(&self.mean_brdf, MeanBrdf::new)?;
                let pattern = mean_brdf.samples(case.samples, seed as u32);
                at(SampleDirections::Pattern(pattern))?
            }
            (Variation::Replaced(count, run), _) => {
                let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
                let pattern = replace_samples(&pattern, count, seed.wrapping_add(run << 32));
                at(SampleDirections::Pattern(pattern))?
            }
            (Variation::Readings(sets, displacement), _) => {
                Method::on_host(&named)?.measured_at(displaced(sets, displacement))
            }
            (Variation::Chosen(count), _) => Method::adaptive(Adaptive {
                recipe: &named,
                candidates: Candidates::new(&Limits::NONE),
                begin: Vec::new(),
                samples: count,
                position: Some(Position::new(TimedMachine::default())),
            }),
            (_, Approach::Baseline) => at(SampleDirections::Random(case.samples))?,
            _ => Method::with_recipe(&recipe, basis)?,
        };
        use_method(method)
    }

    /// Passes a method that is not meta-learned.
    fn with_untrained<T>(
        &self,
        case: &Case,
        use_method: impl FnOnce(Method<'_>) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let (model, samples, seed) = (case.model, case.samples, self.settings.seed);
        if model == ModelKind::Linear {
            let columns = self.of_training(&self.columns, Columns::new)?;
            let all_columns: Vec<usize> = (0..columns.count()).collect();
            let basis = principal_components(columns, &all_columns, case.components);
            let directions = match case.approach {
                Approach::Baseline => {
                    SampleDirections::Pattern(min_condition_pattern(&basis, samples, seed))
                }
                Approach::Optimum => SampleDirections::Converged(LINEAR_OPTIMUM_DIRECTIONS),
                _ => SampleDirections::Random(samples),
            };
            let eta = TrainingOptions::PAPER_ETA;
            return use_method(Method::linear(case.method(), &basis, eta, directions));
        }
        use_method(match (case.approach, case.variation) {
            (Approach::Ggx, Variation::Readings(sets, displacement)) => {
                Method::ggx(ReadingSet::geometries(sets, 0.0))
                    .measured_at(displaced(sets, displacement))
            }
            (Approach::Optimum, _) => Method::optimum(model, self.optimum_steps(model)),
            _ => Method::random(model, samples, INNER_STEPS),
        })
    }

    /// Returns the number of steps of the method Optimum. With effort brief or quick, Neural has a tenth of the steps.
    fn optimum_steps(&self, model: ModelKind) -> usize {
        match (self.settings.effort, model) {
            (Effort::Brief | Effort::Quick, ModelKind::Neural) => OPTIMUM_STEPS / 10,
            _ => OPTIMUM_STEPS,
        }
    }

    /// Returns the stored evaluation of a case on a test set, or evaluates it. Also trains the required recipe.
    pub(crate) fn evaluation(
        &self,
        set: &TestSet<'_>,
        case: &Case,
    ) -> anyhow::Result<EvaluationReport> {
        let name = format!("sheets/{}/{}", set.label, case.name());
        let path = self.settings.out.join(format!("{name}.json"));
        if path.exists() {
            let stored =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            return serde_json::from_slice(&stored)
                .with_context(|| format!("{} is damaged: remove it", path.display()));
        }
        ensure!(!interrupted(), STOPPED);
        // Refinement takes too long to repeat.
        let seeds = match case.variation {
            Variation::Refined => 1,
            _ => self.settings.seeds,
        };
        let report = self.with_method(case, |method| {
            eprintln!("evaluating {name}");
            Ok(set
                .evaluator()
                .evaluate(&method, self.settings.seed, seeds)?)
        })?;
        write_file(&path, serde_json::to_string_pretty(&report)?.as_bytes())?;
        Ok(report)
    }
}

/// Returns the directions of readings whose arms are displaced by a number of degrees.
fn displaced(sets: &[ReadingSet], degrees: u8) -> Vec<Angles<f32>> {
    let geometries = ReadingSet::geometries(sets, degrees.into()).into_iter();
    geometries.map(|geometry| geometry.angles).collect()
}

/// Records a value in a file, or compares it with the one that an earlier run recorded there.
fn require_recorded(path: &Path, value: &Value) -> anyhow::Result<()> {
    if !path.exists() {
        return write_file(path, serde_json::to_string_pretty(value)?.as_bytes());
    }
    let existing = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(
        serde_json::from_slice(&existing).ok().as_ref() == Some(value),
        "{} is of other settings or materials than this run: give another --out, or remove that folder",
        path.display()
    );
    Ok(())
}

/// Replaces `count` samples of a pattern, chosen at random, by uniform random ones.
fn replace_samples(pattern: &[Angles<f32>], count: usize, seed: u64) -> Vec<Angles<f32>> {
    let mut indices: Vec<usize> = (0..pattern.len()).collect();
    indices.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut pattern = pattern.to_vec();
    for (index, angles) in indices.into_iter().zip(uniform_valid(count, seed)) {
        pattern[index] = angles;
    }
    pattern
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_requested_number_of_samples() {
        let pattern = uniform_valid(8, 1);
        for count in [0, 2, 8] {
            let changed = replace_samples(&pattern, count, 7);
            let differ = pattern.iter().zip(&changed).filter(|(a, b)| a != b);
            assert_eq!(differ.count(), count);
        }
        assert_ne!(
            replace_samples(&pattern, 2, 7),
            replace_samples(&pattern, 2, 8)
        );
    }
}
