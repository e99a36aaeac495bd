//! Cases that the experiments evaluate, and the trainings that they require.

use std::fmt;

use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::names;
use glimpse_fitting::choice::Choice;
use glimpse_fitting::measurement::ReadingSet;
use glimpse_fitting::recipe::options::{Schedule, TrainingOptions};
use serde::Deserialize;

/// The paper's number of samples n.
pub(super) const SAMPLES: usize = 8;
/// The speed of all axes for [`Variation::Within`], in degrees per second.
pub(super) const MOTION_SPEED: f64 = 10.0;
/// The number of further steps of [`Variation::Refined`].
pub(super) const REFINEMENT_STEPS: usize = 10_000;

/// A method that the experiments compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Approach {
    /// No measurement: f = 0.
    Black,
    /// Random samples, without meta-learned parts.
    Random,
    /// For Linear, the pattern and ridge solve of Nielsen, Jensen and Ramamoorthi 2015. For other models, random samples
    /// with the initial parameters and step sizes of the paper's method (Meta).
    Baseline,
    /// The paper's method: learned initial parameters, step sizes and pattern (schedule paper).
    Paper,
    /// A learned pattern, and a learned map that completes the readings (schedule prior). With n = 0, a learned prior that
    /// completes readings at any directions.
    Glimpse,
    /// A diffuse and a GGX lobe, fitted by least squares.
    Ggx,
    /// The best fit with unlimited samples.
    Optimum,
}

/// The methods that the paper compares, and Glimpse.
pub(super) const COMPARED: [Approach; 4] = [
    Approach::Random,
    Approach::Baseline,
    Approach::Paper,
    Approach::Glimpse,
];

/// The half of the materials that a pattern is trained on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Subset {
    All,
    Diffuse,
    Glossy,
}

/// A variation of a training or of a method. In tables, it is written without the index of a random run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variation {
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
    /// Readings of sets, with both arms of exact directions displaced from the normal by a number of degrees.
    Readings(&'static [ReadingSet], u8),
    /// A number of readings, each at the direction that reduces the expected loss most per second.
    Chosen(usize),
    /// [`REFINEMENT_STEPS`] further steps on fresh random samples.
    Refined,
}

impl fmt::Display for Variation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("unchanged"),
            Self::Seed(number) => write!(f, "seed + {number}"),
            Self::Twice => f.write_str("both stages twice"),
            Self::PatternOf(subset) => f.write_str(&subset.name()),
            Self::Within(seconds) => write!(f, "{seconds} s of motion"),
            Self::Replaced(count, _) => write!(f, "{count} of {SAMPLES} replaced"),
            Self::Importance => f.write_str("importance"),
            Self::Readings(sets, degrees) => {
                let names = sets.iter().map(|set| set.name());
                f.write_str(&names.collect::<Vec<_>>().join(", "))?;
                match degrees {
                    0 => Ok(()),
                    degrees => write!(f, ", {degrees} degree off"),
                }
            }
            Self::Chosen(_) => f.write_str("chosen by the readings"),
            Self::Refined => write!(f, "{REFINEMENT_STEPS} more steps"),
        }
    }
}

/// A method for a model and a number of samples n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Case {
    pub(super) approach: Approach,
    pub(super) model: ModelKind,
    /// n; 0 for Optimum, and for readings at any directions.
    pub(super) samples: usize,
    /// Number of components of Linear, except for Glimpse.
    pub(super) components: usize,
    pub(super) variation: Variation,
}

impl Case {
    /// Creates a case with the paper's five components.
    pub(super) const fn new(approach: Approach, model: ModelKind, samples: usize) -> Self {
        Self {
            approach,
            model,
            samples,
            components: TrainingOptions::PAPER_BASES,
            variation: Variation::None,
        }
    }

    /// Returns the case with a variation.
    pub(super) const fn with(self, variation: Variation) -> Self {
        Self { variation, ..self }
    }

    /// Returns the cases of methods for models, in variations, and for each n.
    pub(super) fn all(
        approaches: &[Approach],
        models: &[ModelKind],
        variations: &[Variation],
        samples: &[usize],
    ) -> Vec<Self> {
        let mut cases = Vec::new();
        for &model in models {
            for &approach in approaches {
                for &variation in variations {
                    let of_n = samples.iter().map(|n| Self::new(approach, model, *n));
                    cases.extend(of_n.map(|case| case.with(variation)));
                }
            }
        }
        cases
    }

    /// Returns the method's name in tables and pictures.
    pub(super) fn method(&self) -> &'static str {
        match self.approach {
            Approach::Black => "black: f = 0",
            Approach::Random => names::RANDOM,
            Approach::Baseline if self.model == ModelKind::Linear => names::NJR15,
            Approach::Baseline => names::META,
            Approach::Paper => names::PAPER,
            Approach::Glimpse => names::GLIMPSE,
            Approach::Ggx => names::GGX,
            Approach::Optimum => names::OPTIMUM,
        }
    }

    /// Returns the schedule of the required training, if any.
    pub(super) fn schedule(&self) -> Option<Schedule> {
        match self.approach {
            Approach::Baseline if self.model == ModelKind::Linear => None,
            Approach::Baseline | Approach::Paper => Some(Schedule::Paper),
            Approach::Glimpse => Some(Schedule::Prior),
            _ => None,
        }
    }

    /// Returns the case whose recipe this one uses, if any. Meta uses the recipe of the paper's method, since the second
    /// stage of schedule paper learns the pattern and does not change initial parameters or step sizes.
    pub(super) fn trained(&self) -> Option<Self> {
        let approach = match self.schedule()? {
            Schedule::Paper => Approach::Paper,
            Schedule::Prior => Approach::Glimpse,
        };
        let variation = match self.variation {
            of_training @ (Variation::Seed(_)
            | Variation::Twice
            | Variation::PatternOf(_)
            | Variation::Within(_)) => of_training,
            _ => Variation::None,
        };
        Some(Self {
            approach,
            variation,
            ..*self
        })
    }

    /// Returns the name of the case's files: lowercase letters, digits and hyphens.
    pub(super) fn name(&self) -> String {
        let mut name = self.model.name().to_owned();
        if self.samples > 0 {
            name += &format!("-n{}", self.samples);
        }
        if self.model == ModelKind::Linear && self.approach != Approach::Glimpse {
            name += &format!("-m{}", self.components);
        }
        name += &format!("-{:?}", self.approach);
        if self.variation != Variation::None {
            name += &format!("-{:?}", self.variation);
        }
        let words = name.split(|character: char| !character.is_ascii_alphanumeric());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        words.join("-").to_lowercase()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_different_cases_have_different_names() {
        let case = Case::new(Approach::Paper, ModelKind::Linear, SAMPLES);
        assert_eq!(case.name(), "linear-n8-m5-paper");
        let replaced = |run| case.with(Variation::Replaced(2, run)).name();
        assert_eq!(replaced(1), "linear-n8-m5-paper-replaced-2-1");
        assert_ne!(replaced(1), replaced(2));
    }
}
