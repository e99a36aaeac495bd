//! Cases that the experiments evaluate, and the trainings that they require.

use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::names;
use glimpse_fitting::measurement::Instrument;
use glimpse_training::choice::Choice;
use glimpse_training::meta::options::{Schedule, TrainingOptions};

/// A method that the experiments compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Approach {
    /// Random samples, without meta-learned parts.
    Random,
    /// Random samples, with the initial parameters and step sizes of the paper's method.
    Meta,
    /// The pattern and ridge solve of Nielsen, Jensen and Ramamoorthi 2015, for Linear only.
    Njr15,
    /// The paper's method: learned initial parameters, step sizes and pattern (schedule paper).
    Paper,
    /// A learned pattern, and a learned map that completes the readings (schedule prior).
    Glimpse,
    /// A learned prior that completes readings at any directions (schedule prior, without a pattern).
    Any,
    /// A diffuse and a GGX lobe, fitted by least squares.
    Ggx,
    /// The best fit with unlimited samples.
    Optimum,
}

impl Approach {
    /// Returns the name in tables and pictures.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Random => names::RANDOM,
            Self::Meta => names::META,
            Self::Njr15 => names::NJR15,
            Self::Paper => names::PAPER,
            Self::Glimpse | Self::Any => names::GLIMPSE,
            Self::Ggx => names::GGX,
            Self::Optimum => names::OPTIMUM,
        }
    }

    /// Returns the schedule of the required training, if any.
    pub(super) fn schedule(self) -> Option<Schedule> {
        match self {
            Self::Meta | Self::Paper => Some(Schedule::Paper),
            Self::Glimpse | Self::Any => Some(Schedule::Prior),
            Self::Random | Self::Njr15 | Self::Ggx | Self::Optimum => None,
        }
    }

    /// Returns the paper's baseline: NJR15 for Linear, and Meta for other models.
    pub(super) fn baseline(model: ModelKind) -> Self {
        match model {
            ModelKind::Linear => Self::Njr15,
            _ => Self::Meta,
        }
    }

    /// Returns the methods that the paper compares, and Glimpse.
    pub(super) fn compared(model: ModelKind) -> [Self; 4] {
        [
            Self::Random,
            Self::baseline(model),
            Self::Paper,
            Self::Glimpse,
        ]
    }
}

/// The half of the materials that a pattern is trained on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subset {
    All,
    Diffuse,
    Glossy,
}

impl Subset {
    pub(super) const EACH: [Self; 3] = [Self::All, Self::Diffuse, Self::Glossy];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Diffuse => "diffuse",
            Self::Glossy => "glossy",
        }
    }
}

/// The displacements of both arms away from the normal, in degrees, with their descriptions.
pub(super) const DISPLACEMENTS: [(u8, &str); 2] = [(0, "exact"), (1, "1 degree off")];

/// A variation of a training or of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Variation {
    None,
    /// Training with another seed: the run's seed plus this number.
    Seed(u64),
    /// Training with both stages repeated.
    Twice,
    /// Training of the pattern only, on a subset, with the initial parameters and step sizes of the paper's method.
    PatternOf(Subset),
    /// Training within a budget for motion, in seconds at [`MOTION_SPEED`] without settling.
    Within(u32),
    /// A number of samples replaced by random ones, and the index of the random run.
    Replaced(usize, u64),
    /// Samples drawn by importance of the mean BRDF.
    Importance,
    /// Readings at the directions of an instrument, with displaced arms.
    Readings(Instrument, u8),
    /// A number of readings, each at the direction that reduces the expected loss most per second.
    Chosen(usize),
    /// [`REFINEMENT_STEPS`] further steps on fresh random samples.
    Refined,
}

/// The speed of all axes for [`Variation::Within`], in degrees per second.
pub(super) const MOTION_SPEED: f64 = 10.0;
/// The number of further steps of [`Variation::Refined`].
pub(super) const REFINEMENT_STEPS: usize = 10_000;

impl Variation {
    /// Returns the part of file names.
    fn suffix(self) -> String {
        match self {
            Self::None => String::new(),
            Self::Seed(number) => format!("-seed{number}"),
            Self::Twice => "-twice".into(),
            Self::PatternOf(subset) => format!("-pattern-{}", subset.name()),
            Self::Within(seconds) => format!("-within-{seconds}s"),
            Self::Replaced(count, run) => format!("-replaced{count}-run{run}"),
            Self::Importance => "-importance".into(),
            Self::Readings(instrument, displacement) => {
                let arms = if displacement > 0 {
                    "displaced"
                } else {
                    "none"
                };
                format!("-{instrument:?}-{arms}").to_lowercase()
            }
            Self::Chosen(count) => format!("-chosen{count}"),
            Self::Refined => "-refined".into(),
        }
    }

    /// Returns true if the variation changes the training.
    fn is_of_training(self) -> bool {
        !matches!(
            self,
            Self::Replaced(..)
                | Self::Importance
                | Self::Readings(..)
                | Self::Chosen(_)
                | Self::Refined
                | Self::None
        )
    }
}

/// A method for a model and a number of samples n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Case {
    pub(super) approach: Approach,
    pub(super) model: ModelKind,
    /// n; 0 for Optimum.
    pub(super) samples: usize,
    /// Number of components of Linear, except for Glimpse.
    pub(super) components: usize,
    pub(super) variation: Variation,
}

impl Case {
    /// Creates a case with the paper's five components.
    pub(super) fn new(approach: Approach, model: ModelKind, samples: usize) -> Self {
        Self {
            approach,
            model,
            samples,
            components: TrainingOptions::PAPER_BASES,
            variation: Variation::None,
        }
    }

    /// Returns the case with a variation.
    pub(super) fn with(self, variation: Variation) -> Self {
        Self { variation, ..self }
    }

    /// Returns the training that the case requires, if any. Meta uses the recipe of the paper's method, since the second stage
    /// of schedule paper learns the pattern and does not change initial parameters or step sizes.
    pub(super) fn training(&self) -> Option<Training> {
        Some(Training {
            model: self.model,
            samples: self.samples,
            schedule: self.approach.schedule()?,
            components: self.components,
            variation: match self.variation {
                variation if variation.is_of_training() => variation,
                _ => Variation::None,
            },
        })
    }

    /// Returns the name of the evaluation's file.
    pub(super) fn name(&self) -> String {
        let base = match self.training() {
            Some(training) => training.name(),
            None => base_name(self.model, self.samples, Some(self.components)),
        };
        let suffix = match self.variation {
            variation if variation.is_of_training() => String::new(),
            variation => variation.suffix(),
        };
        let method = match self.approach {
            // The recipe's own method.
            Approach::Paper | Approach::Glimpse | Approach::Any => String::new(),
            other => format!("-{}", other.name().to_lowercase()),
        };
        format!("{base}{method}{suffix}")
    }
}

/// A training that produces a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Training {
    pub(super) model: ModelKind,
    pub(super) samples: usize,
    pub(super) schedule: Schedule,
    pub(super) components: usize,
    pub(super) variation: Variation,
}

impl Training {
    /// Returns the training that this one starts from, if any.
    pub(super) fn prerequisite(&self) -> Option<Self> {
        matches!(self.variation, Variation::PatternOf(_)).then_some(Self {
            variation: Variation::None,
            ..*self
        })
    }

    /// Returns the name of the recipe's file.
    pub(super) fn name(&self) -> String {
        let components = (self.schedule != Schedule::Prior).then_some(self.components);
        format!(
            "{}-{}{}",
            base_name(self.model, self.samples, components),
            self.schedule.name(),
            self.variation.suffix()
        )
    }
}

fn base_name(model: ModelKind, samples: usize, components: Option<usize>) -> String {
    let mut name = model.name().to_owned();
    if samples > 0 {
        name += &format!("-n{samples}");
    }
    if let (ModelKind::Linear, Some(components)) = (model, components) {
        name += &format!("-m{components}");
    }
    name
}
