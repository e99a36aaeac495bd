//! Methods to evaluate, and recipes to train for them.

use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_training::linear::Prior;
use glimpse_training::meta::options::Parts;
use glimpse_training::meta::plan::Schedule;

/// A way to measure and fit materials; one that is learned names its schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Approach {
    Random,
    Meta(Schedule),
    Njr15,
    /// Start, step sizes and pattern are learned; by schedule prior readings are completed too.
    Ours(Schedule),
    Optimum,
}

/// A value's name on the command line.
pub(super) fn name_of(value: impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned())
}

impl Approach {
    /// The method's name without its schedule.
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

    /// The schedule of the training that the method needs, if it needs one.
    pub(crate) fn schedule(self) -> Option<Schedule> {
        match self {
            Self::Meta(schedule) | Self::Ours(schedule) => Some(schedule),
            Self::Random | Self::Njr15 | Self::Optimum => None,
        }
    }

    /// The method's name in tables and pictures, with its schedule in parentheses.
    pub(crate) fn title(self) -> String {
        match self.schedule() {
            Some(schedule) => format!("{} ({})", self.name(), name_of(schedule)),
            None => self.name().into(),
        }
    }

    /// The one that learns less than Ours: the paper compares Linear with NJR15.
    pub(crate) fn baseline(model: ModelKind, schedule: Schedule) -> Self {
        match model {
            ModelKind::Linear => Self::Njr15,
            _ => Self::Meta(schedule),
        }
    }

    /// The methods that the paper compares, trained by one schedule.
    pub(crate) fn rivals(model: ModelKind, schedule: Schedule) -> [Self; 3] {
        let baseline = Self::baseline(model, schedule);
        [Self::Random, baseline, Self::Ours(schedule)]
    }
}

/// A method for a model and n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Case {
    pub(crate) approach: Approach,
    pub(crate) model: ModelKind,
    pub(crate) samples: usize,
    /// Linear's prior.
    pub(crate) prior: Prior,
}

impl Case {
    /// With the paper's prior, which is five components and eta = 40.
    pub(crate) fn new(approach: Approach, model: ModelKind, samples: usize) -> Self {
        Self {
            approach,
            model,
            samples,
            prior: Prior::PAPER,
        }
    }

    pub(super) fn name(&self) -> String {
        let (model, n) = (self.model.name(), self.samples);
        let bases = bases(self.model, self.prior);
        match (self.approach, TrainingRun::of(self)) {
            (Approach::Meta(_), Some(training)) => format!("{}-on-random", training.name()),
            (_, Some(training)) => format!("{}-ours", training.name()),
            (Approach::Optimum, None) => format!("{model}-optimum{bases}"),
            (approach, None) => format!("{model}-n{n}{bases}-{}", approach.name().to_lowercase()),
        }
    }
}

fn bases(model: ModelKind, Prior { components, eta }: Prior) -> String {
    if model != ModelKind::Linear {
        return String::new();
    }
    let eta = eta.map_or_else(|| "learned".to_owned(), |eta| eta.to_string());
    format!("-m{components}-eta-{eta}")
}

/// A recipe to be trained.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrainingRun {
    pub(crate) model: ModelKind,
    pub(crate) samples: usize,
    pub(crate) schedule: Schedule,
    pub(crate) parts: Parts,
    pub(crate) prior: Prior,
    /// Added to the seed.
    pub(crate) repetition: u64,
    /// The only materials to train on, with a name for them; all if there is none.
    pub(crate) only: Option<(&'static str, Vec<String>)>,
}

impl TrainingRun {
    /// The training that a case needs, if it needs one.
    ///
    /// Meta by the paper's schedule takes the recipe of Ours: the second stage, which learns the
    /// pattern, leaves start and step sizes as they are.
    pub(crate) fn of(case: &Case) -> Option<Self> {
        let schedule = case.approach.schedule()?;
        Some(Self {
            model: case.model,
            samples: case.samples,
            schedule,
            parts: match case.approach {
                Approach::Meta(Schedule::Joint | Schedule::Prior) => Parts::WithoutPattern,
                _ => Parts::All,
            },
            prior: case.prior,
            repetition: 0,
            only: None,
        })
    }

    /// The training that has to be done before, as this one starts from what it learned.
    pub(super) fn needs(&self) -> Option<Self> {
        matches!(self.parts, Parts::PatternOnly(_)).then(|| Self {
            parts: Parts::WithoutPattern,
            repetition: 0,
            only: None,
            ..self.clone()
        })
    }

    pub(super) fn name(&self) -> String {
        let mut name = format!("{}-n{}", self.model.name(), self.samples);
        // A learned map takes the place of Linear's prior.
        if self.schedule != Schedule::Prior {
            name += &bases(self.model, self.prior);
        }
        name += &format!("-{}", name_of(self.schedule));
        name += match self.parts {
            Parts::All => "",
            Parts::AllTwice => "-twice",
            Parts::WithoutPattern => "-meta",
            Parts::PatternOnly(_) => "-pattern",
        };
        if let Some((subset, _)) = &self.only {
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
    fn schedules_share_neither_a_label_nor_a_recipe_nor_a_sheet() {
        for model in [ModelKind::Linear, ModelKind::Neural] {
            let cases = Schedule::value_variants()
                .iter()
                .map(|schedule| Case::new(Approach::Ours(*schedule), model, 8));
            let mut seen: Vec<[String; 3]> = Vec::new();
            for case in cases {
                let training = TrainingRun::of(&case).expect("Ours is trained");
                assert_eq!(Some(training.schedule), case.approach.schedule());
                let names = [case.approach.title(), training.name(), case.name()];
                for (index, name) in names.iter().enumerate() {
                    assert!(seen.iter().all(|other| other[index] != *name), "{name}");
                    assert!(name.contains(&name_of(training.schedule)), "{name}");
                }
                seen.push(names);
            }
        }
        for approach in [Approach::Random, Approach::Njr15, Approach::Optimum] {
            let case = Case::new(approach, ModelKind::Linear, 8);
            assert_eq!(TrainingRun::of(&case), None);
        }
    }

    #[test]
    fn meta_by_the_paper_s_schedule_takes_the_recipe_of_ours() {
        let training = |approach| TrainingRun::of(&Case::new(approach, ModelKind::Neural, 8));
        let of = |schedule| {
            (
                training(Approach::Meta(schedule)),
                training(Approach::Ours(schedule)),
            )
        };
        let (meta, ours) = of(Schedule::Paper);
        assert_eq!(meta, ours);
        let (meta, ours) = of(Schedule::Joint);
        assert_ne!(meta, ours);
    }
}
