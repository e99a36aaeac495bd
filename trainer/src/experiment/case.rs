//! Methods to evaluate, and recipes to train for them.

use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_training::linear::Prior;
use glimpse_training::meta::plan::TrainedParts;
use glimpse_training::meta::plan::{PretrainedInit, Schedule};
use glimpse_training::meta::scan_budget::ScanBudget;
use glimpse_training::route::Axes;

/// A method that the experiments compare. A learned method contains its schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Approach {
    /// Random samples, without meta-learned parts.
    Random,
    /// Random samples, with learned initial parameters and step sizes.
    Meta(Schedule),
    /// The pattern and ridge solve of Nielsen, Jensen and Ramamoorthi 2015, for Linear only.
    Njr15,
    /// Learned initial parameters, step sizes and pattern; with `--schedule prior` also a learned completion.
    Ours(Schedule),
    /// The best fit with unlimited samples.
    Optimum,
}

/// Returns a value's name on the command line.
pub(super) fn value_name(value: impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned())
}

impl Approach {
    /// Returns the method's name without its schedule.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Random => "Random",
            Self::Meta(_) => "Meta",
            Self::Njr15 => "NJR15",
            Self::Ours(Schedule::Prior) => "Completed",
            Self::Ours(Schedule::Joint | Schedule::Paper) => "Ours",
            Self::Optimum => "Optimum",
        }
    }

    /// Returns the schedule of the required training, if any.
    pub(crate) fn schedule(self) -> Option<Schedule> {
        match self {
            Self::Meta(schedule) | Self::Ours(schedule) => Some(schedule),
            Self::Random | Self::Njr15 | Self::Optimum => None,
        }
    }

    /// Returns the method's name for tables and pictures, with its schedule in parentheses.
    pub(crate) fn title(self) -> String {
        match self.schedule() {
            Some(schedule) => format!("{} ({})", self.name(), value_name(schedule)),
            None => self.name().into(),
        }
    }

    /// Returns the baseline that Ours is compared with: NJR15 for Linear, as in the paper, and Meta for other models.
    pub(crate) fn baseline(model: ModelKind, schedule: Schedule) -> Self {
        match model {
            ModelKind::Linear => Self::Njr15,
            _ => Self::Meta(schedule),
        }
    }

    /// Returns the methods that the paper compares, trained with one schedule.
    pub(crate) fn compared(model: ModelKind, schedule: Schedule) -> [Self; 3] {
        let baseline = Self::baseline(model, schedule);
        [Self::Random, baseline, Self::Ours(schedule)]
    }
}

/// A method for a model and a number of samples n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Case {
    pub(crate) approach: Approach,
    pub(crate) model: ModelKind,
    pub(crate) samples: usize,
    /// Prior of Linear.
    pub(crate) prior: Prior,
    /// Budget for motion in the training, in seconds at [`MOTION_SPEED`], without settling. For schedule prior.
    pub(crate) motion: Option<u32>,
}

/// The speed of all axes for [`Case::motion`], in degrees per second.
pub(crate) const MOTION_SPEED: f64 = 10.0;

impl Case {
    /// Creates a case with the paper's prior, five components and eta = 40.
    pub(crate) fn new(approach: Approach, model: ModelKind, samples: usize) -> Self {
        Self {
            approach,
            model,
            samples,
            prior: Prior::PAPER,
            motion: None,
        }
    }

    /// Returns the name of the evaluation's file.
    pub(super) fn name(&self) -> String {
        let (model, n) = (self.model.name(), self.samples);
        let prior_suffix = prior_suffix(self.model, self.prior);
        match (self.approach, TrainingRun::for_case(self)) {
            (Approach::Meta(_), Some(training)) => format!("{}-on-random", training.name()),
            (_, Some(training)) => format!("{}-ours", training.name()),
            (Approach::Optimum, None) => format!("{model}-optimum{prior_suffix}"),
            (approach, None) => format!(
                "{model}-n{n}{prior_suffix}-{}",
                approach.name().to_lowercase()
            ),
        }
    }
}

fn prior_suffix(model: ModelKind, Prior { components, eta }: Prior) -> String {
    if model != ModelKind::Linear {
        return String::new();
    }
    let eta = eta.map_or_else(|| "learned".to_owned(), |eta| eta.to_string());
    format!("-m{components}-eta-{eta}")
}

/// A training that produces a recipe.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrainingRun {
    pub(crate) model: ModelKind,
    pub(crate) samples: usize,
    pub(crate) schedule: Schedule,
    pub(crate) parts: TrainedParts,
    /// Initial parameters and step sizes for [`TrainedParts::PatternOnly`].
    pub(crate) pretrained: Option<PretrainedInit>,
    pub(crate) prior: Prior,
    /// Budget for motion, as in [`Case::motion`].
    pub(crate) motion: Option<u32>,
    /// Index of the repetition, which is added to the seed.
    pub(crate) repetition: u64,
    /// Name and materials of a subset to train on; None for all materials.
    pub(crate) subset: Option<(&'static str, Vec<String>)>,
}

impl TrainingRun {
    /// Returns the training that a case requires, if any.
    ///
    /// With the paper's schedule, Meta uses the recipe of Ours: the second stage learns the pattern and does not
    /// change initial parameters or step sizes.
    pub(crate) fn for_case(case: &Case) -> Option<Self> {
        let schedule = case.approach.schedule()?;
        Some(Self {
            model: case.model,
            samples: case.samples,
            schedule,
            parts: match case.approach {
                Approach::Meta(Schedule::Joint | Schedule::Prior) => TrainedParts::WithoutPattern,
                _ => TrainedParts::All,
            },
            pretrained: None,
            prior: case.prior,
            motion: case.motion,
            repetition: 0,
            subset: None,
        })
    }

    /// Returns the budget for motion, if any.
    pub(super) fn motion_budget(&self) -> Option<ScanBudget> {
        self.motion.map(|seconds| ScanBudget {
            seconds: f64::from(seconds),
            speeds: Axes::from_array([MOTION_SPEED; 4]),
            settle: 0.0,
        })
    }

    /// Returns the training that this one starts from, if any.
    pub(super) fn prerequisite(&self) -> Option<Self> {
        matches!(self.parts, TrainedParts::PatternOnly).then(|| Self {
            parts: TrainedParts::WithoutPattern,
            pretrained: None,
            repetition: 0,
            subset: None,
            ..self.clone()
        })
    }

    /// Returns the name of the recipe's file.
    pub(super) fn name(&self) -> String {
        let mut name = format!("{}-n{}", self.model.name(), self.samples);
        // With schedule prior, a learned map replaces the prior of Linear.
        if self.schedule != Schedule::Prior {
            name += &prior_suffix(self.model, self.prior);
        }
        name += &format!("-{}", value_name(self.schedule));
        name += match self.parts {
            TrainedParts::All => "",
            TrainedParts::AllTwice => "-twice",
            TrainedParts::WithoutPattern => "-meta",
            TrainedParts::PatternOnly => "-pattern",
        };
        if let Some(seconds) = self.motion {
            name += &format!("-within-{seconds}s");
        }
        if let Some((subset, _)) = &self.subset {
            name += &format!("-{subset}");
        }
        match self.repetition {
            0 => name,
            repetition => format!("{name}-seed{repetition}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_have_distinct_titles_and_files() {
        for model in [ModelKind::Linear, ModelKind::Neural] {
            let cases = Schedule::value_variants()
                .iter()
                .map(|schedule| Case::new(Approach::Ours(*schedule), model, 8));
            let mut seen: Vec<[String; 3]> = Vec::new();
            for case in cases {
                let training = TrainingRun::for_case(&case).expect("Ours is trained");
                assert_eq!(Some(training.schedule), case.approach.schedule());
                let names = [case.approach.title(), training.name(), case.name()];
                for (index, name) in names.iter().enumerate() {
                    assert!(seen.iter().all(|other| other[index] != *name), "{name}");
                    assert!(name.contains(&value_name(training.schedule)), "{name}");
                }
                seen.push(names);
            }
        }
        for approach in [Approach::Random, Approach::Njr15, Approach::Optimum] {
            let case = Case::new(approach, ModelKind::Linear, 8);
            assert_eq!(TrainingRun::for_case(&case), None);
        }
    }

    #[test]
    fn meta_of_paper_schedule_shares_recipe_with_ours() {
        let training = |approach| TrainingRun::for_case(&Case::new(approach, ModelKind::Neural, 8));
        let meta_and_ours = |schedule| {
            (
                training(Approach::Meta(schedule)),
                training(Approach::Ours(schedule)),
            )
        };
        let (meta, ours) = meta_and_ours(Schedule::Paper);
        assert_eq!(meta, ours);
        let (meta, ours) = meta_and_ours(Schedule::Joint);
        assert_ne!(meta, ours);
    }
}
