//! The store that all experiments share: materials, trained recipes and evaluations.
//!
//! Recipes and evaluations are stored in the output folder under descriptive names. An interrupted run continues from
//! them, and experiments that use the same recipe train it once.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::{Angles, Arms};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::{
    Adaptive, Evaluator, LINEAR_OPTIMUM_DIRECTIONS, Method, OPTIMUM_STEPS, Report, SampleDirections,
};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::write_atomic;
use glimpse_materials::loss::DIRECTIONS;
use glimpse_materials::sampling::{MeanBrdf, uniform_valid};
use glimpse_materials::{Material, Source, SourceShare};
use glimpse_training::linear::{Columns, min_condition_pattern, principal_components};
use glimpse_training::meta::options::{
    Effort, PretrainedInit, Schedule, TrainedParts, TrainingOptions,
};
use glimpse_training::meta::outer::Checkpoints;
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::RecipeFile;
use glimpse_training::route::{Machine, Position, SpeedArgs};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use super::case::{Approach, Case, MOTION_SPEED, REFINEMENT_STEPS, Training, Variation};
use super::glossiness::split_by_glossiness;

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
}

impl Settings {
    /// Returns the effort of trainings with a schedule.
    pub(super) fn effort_for(&self, schedule: Schedule) -> Effort {
        match schedule {
            Schedule::Paper => self.paper_effort,
            _ => self.effort,
        }
    }
}

/// Materials to evaluate on.
pub(crate) struct TestSet<'a> {
    /// Name of the set's folder of evaluations, which is also a part of table names.
    pub(super) label: String,
    /// Name of the source.
    pub(super) source: String,
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

/// A training, or the evaluation of a case on the test set with an index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Work {
    Train(Training),
    Evaluate(usize, Case),
}

/// A function that trains on materials with a name, and writes the recipe.
pub(crate) type TrainToFile = dyn Fn(
    &TrainingOptions,
    Vec<Box<dyn Material>>,
    &Checkpoints,
    &str,
    &Path,
) -> anyhow::Result<()>;

/// The store of recipes and evaluations.
pub(crate) struct Store<'a> {
    pub(super) settings: Settings,
    /// The test set, followed by those of the option --additional.
    pub(super) sets: &'a [TestSet<'a>],
    train_to_file: &'a TrainToFile,
    /// Number of materials to train on.
    pub(super) training_count: usize,
    /// Columns of the training materials, for the basis of Linear.
    columns: OnceCell<Columns>,
    mean_brdf: OnceCell<MeanBrdf>,
}

impl<'a> Store<'a> {
    /// Opens the output folder, and records the settings in it.
    ///
    /// # Errors
    /// If the folder has results of other settings, or a file cannot be read or written.
    pub(crate) fn open(
        settings: Settings,
        training: &[Box<dyn Material>],
        sets: &'a [TestSet<'a>],
        train_to_file: &'a TrainToFile,
    ) -> anyhow::Result<Self> {
        let path = settings.out.join("settings.json");
        let names = |materials: &[Box<dyn Material>]| {
            let names = materials.iter().map(|material| material.name().to_owned());
            names.collect::<Vec<_>>()
        };
        // A folder with other settings is rejected.
        let recorded = json!({
            "trainer": env!("CARGO_PKG_VERSION"),
            "effort": settings.effort,
            "paper_effort": settings.paper_effort,
            "seed": settings.seed,
            "seeds": settings.seeds,
            "trained_on": names(training),
            "evaluated_on": names(sets[0].materials),
            "directions": DIRECTIONS,
        });
        if path.exists() {
            let existing =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            if serde_json::from_slice(&existing).ok() != Some(recorded) {
                bail!(
                    "{} has results of other settings or materials, which are in {}: give another \
                     --out, or remove the folder",
                    settings.out.display(),
                    path.display()
                );
            }
        } else {
            write_file(&path, serde_json::to_string_pretty(&recorded)?.as_bytes())?;
        }
        Ok(Self {
            settings,
            sets,
            train_to_file,
            training_count: training.len(),
            columns: OnceCell::new(),
            mean_brdf: OnceCell::new(),
        })
    }

    fn recipe_path(&self, training: &Training) -> PathBuf {
        let name = format!("recipes/{}.recipe", training.name());
        self.settings.out.join(name)
    }

    fn evaluation_name(&self, set: usize, case: &Case) -> String {
        format!("sheets/{}/{}", self.sets[set].label, case.name())
    }

    /// Trains or evaluates, unless the result is stored. Also trains the recipes that this requires.
    pub(crate) fn perform(&self, work: &Work) -> anyhow::Result<()> {
        match work {
            Work::Train(training) => self.recipe(training).map(drop),
            Work::Evaluate(set, case) => self.evaluation(*set, case).map(drop),
        }
    }

    /// Returns the stored recipe of a training and the basis of Linear, or trains it.
    pub(super) fn recipe(
        &self,
        training: &Training,
    ) -> anyhow::Result<(RecipeFile, Option<Basis>)> {
        let path = self.recipe_path(training);
        if !path.exists() {
            self.train(training, &path)?;
        }
        Ok(RecipeFile::read_with_basis(&path)?)
    }

    fn train(&self, training: &Training, path: &Path) -> anyhow::Result<()> {
        let mut materials = self.settings.data.load()?;
        if let Variation::PatternOf(subset) = training.variation {
            let names = split_by_glossiness(&materials, self.settings.seed, subset);
            materials.retain(|material| names.iter().any(|name| name == material.name()));
        }
        let pretrained = training.prerequisite().map(|before| self.descent(&before));
        let repetition = match training.variation {
            Variation::Seed(number) => number,
            _ => 0,
        };
        let defaults = TrainingOptions::new(
            training.model,
            training.samples,
            training.schedule,
            self.settings.effort_for(training.schedule),
            self.settings.seed.wrapping_add(repetition),
        );
        let mut options = TrainingOptions {
            source_shares: vec![SourceShare::single(&self.settings.data, materials.len())],
            parts: match training.variation {
                Variation::Twice => TrainedParts::AllTwice,
                Variation::PatternOf(_) => TrainedParts::PatternOnly(pretrained.transpose()?),
                _ => TrainedParts::All,
            },
            ..defaults
        };
        if training.schedule == Schedule::Paper {
            options.bases = training.components;
        }
        if let Variation::Within(seconds) = training.variation {
            options.scan_seconds = Some(f64::from(seconds));
            options.speeds = SpeedArgs {
                speed: Some(Arms::from_array([MOTION_SPEED; 4])),
                settle: Some(0.0),
            };
        }
        let checkpoints = Checkpoints {
            directory: path.with_extension("checkpoint"),
            resume: true,
        };
        let folder = self.settings.out.join("recipes");
        fs::create_dir_all(&folder)
            .with_context(|| format!("cannot write {}", folder.display()))?;
        eprintln!("training {}", training.name());
        (self.train_to_file)(
            &options,
            materials,
            &checkpoints,
            self.settings.data.label(),
            path,
        )
    }

    /// Returns the initial parameters and step sizes of a training.
    fn descent(&self, training: &Training) -> anyhow::Result<PretrainedInit> {
        let (file, _) = self.recipe(training)?;
        let recipe = file.recipe();
        let Estimator::Sgd(sgd) = recipe.estimator() else {
            bail!(
                "{} is not fitted by descent: remove it to train it again",
                self.recipe_path(training).display()
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

    /// Returns the first `components` principal components of the training materials.
    fn basis(&self, components: usize) -> anyhow::Result<Basis> {
        let columns = self.of_training(&self.columns, Columns::new)?;
        let all_columns: Vec<usize> = (0..columns.count()).collect();
        Ok(principal_components(columns, &all_columns, components))
    }

    /// Returns `count` directions by importance of the mean of the training materials.
    fn importance(&self, count: usize) -> anyhow::Result<Vec<Angles<f32>>> {
        let mean_brdf = self.of_training(&self.mean_brdf, MeanBrdf::new)?;
        Ok(mean_brdf.samples(count, self.settings.seed as u32))
    }

    /// Passes the method of a case to `use_method`, and returns its result.
    pub(super) fn with_method<T>(
        &self,
        case: &Case,
        use_method: impl FnOnce(&Method<'_>) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let (model, samples, seed) = (case.model, case.samples, self.settings.seed);
        let trained = case.training().map(|training| self.recipe(&training));
        let trained = trained.transpose()?;
        let basis = match (&trained, model) {
            (None, ModelKind::Linear) => Some(self.basis(case.components)?),
            _ => None,
        };
        let any = match (&trained, case.approach) {
            (Some((file, basis)), Approach::Any) => Some(NamedRecipe::new(
                case.name(),
                Arc::new(RecipeFile::new(file.bytes().to_vec())?),
                basis.clone().map(Arc::new),
            )),
            _ => None,
        };
        let lacks_basis = || format!("{} has no basis: remove it to train it again", case.name());
        // The recipe at the directions of an instrument.
        let at_directions = match (&any, case.variation) {
            (Some(named), Variation::Readings(instrument, _)) => {
                let directions = instrument.directions(0.0);
                Some(named.at(&directions, &vec![0.0; directions.len()])?)
            }
            _ => None,
        };
        let method = match (&trained, &basis) {
            (Some((file, basis)), _) => {
                let (recipe, basis) = (file.recipe(), basis.as_ref());
                match (case.variation, case.approach) {
                    (Variation::Importance, _) => {
                        let pattern = self.importance(samples)?;
                        Method::at_directions("importance", &recipe, basis, pattern)
                    }
                    (Variation::Replaced(count, run), _) => {
                        let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
                        let seed = seed.wrapping_add(run << 32);
                        let pattern = replace_samples(&pattern, count, seed);
                        Method::at_directions("replaced", &recipe, basis, pattern)
                    }
                    (Variation::Readings(..), _) => match &at_directions {
                        Some(named) => {
                            let recipe = named.file.recipe();
                            let method = Method::with_recipe(&recipe, named.basis.as_deref())?;
                            Ok(method.with_prior(named.prior.clone()))
                        }
                        None => bail!(lacks_basis()),
                    },
                    (Variation::Chosen(count), _) => {
                        let (any, basis) = any.as_ref().zip(basis).with_context(lacks_basis)?;
                        let recipe = (file, basis, any.prior.clone());
                        let arms = Some(Position::new(Machine::default()));
                        let limits = &Limits::NONE;
                        let scans = Adaptive::new(recipe, Vec::new(), count, limits, arms);
                        Ok(Method::adaptive(scans))
                    }
                    (_, Approach::Meta) => Method::meta(&recipe, basis),
                    _ => Method::with_recipe(&recipe, basis),
                }?
            }
            (None, _) if case.approach == Approach::Ggx => match case.variation {
                Variation::Readings(instrument, _) => Method::ggx(instrument.directions(0.0)),
                _ => bail!("{} has no directions", case.name()),
            },
            (None, Some(basis)) => {
                let directions = match case.approach {
                    Approach::Njr15 => {
                        SampleDirections::Pattern(min_condition_pattern(basis, samples, seed))
                    }
                    Approach::Optimum => SampleDirections::Converged(LINEAR_OPTIMUM_DIRECTIONS),
                    _ => SampleDirections::Random(samples),
                };
                let name = case.approach.name();
                Method::linear(name, basis, TrainingOptions::PAPER_ETA, directions)
            }
            (None, None) => match case.approach {
                Approach::Optimum => Method::optimum(model, self.optimum_steps(model)),
                _ => Method::random(model, samples, INNER_STEPS),
            },
        };
        match case.variation {
            Variation::Refined => use_method(&method.with_refinement(REFINEMENT_STEPS)),
            Variation::Readings(instrument, displacement) => {
                let measured = instrument.directions(displacement.into());
                use_method(&method.measured_at(measured))
            }
            _ => use_method(&method),
        }
    }

    /// Returns the number of steps of the method Optimum. With effort brief or quick, Neural has a tenth of the steps.
    pub(super) fn optimum_steps(&self, model: ModelKind) -> usize {
        match (self.settings.effort, model) {
            (Effort::Brief | Effort::Quick, ModelKind::Neural) => OPTIMUM_STEPS / 10,
            _ => OPTIMUM_STEPS,
        }
    }

    /// Returns the stored evaluation of a case on a test set, or evaluates it.
    pub(super) fn evaluation(&self, set: usize, case: &Case) -> anyhow::Result<Report> {
        let name = self.evaluation_name(set, case);
        let path = self.settings.out.join(format!("{name}.json"));
        if path.exists() {
            let stored =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            return serde_json::from_slice(&stored)
                .with_context(|| format!("{} is damaged: remove it", path.display()));
        }
        // Refinement takes too long to repeat.
        let seeds = match case.variation {
            Variation::Refined => 1,
            _ => self.settings.seeds,
        };
        let report = self.with_method(case, |method| {
            eprintln!("evaluating {name}");
            let evaluator = self.sets[set].evaluator();
            Ok(evaluator.evaluate(method, self.settings.seed, seeds)?)
        })?;
        write_file(&path, serde_json::to_string_pretty(&report)?.as_bytes())?;
        Ok(report)
    }
}

/// Writes a file atomically, and creates its folder if it does not exist.
pub(super) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder)
        .and_then(|()| write_atomic(path, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
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
