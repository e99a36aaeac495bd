//! What is asked of the store: methods to be judged, and recipes to be trained.

use glimpse_core::model::ModelKind;
use glimpse_trainer::linear::Prior;
use glimpse_trainer::meta::options::Parts;
use glimpse_trainer::meta::plan::Schedule;

/// How materials are measured and fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Approach {
    Random,
    Meta,
    Njr15,
    Ours,
    Optimum,
}

impl Approach {
    /// As the paper writes it.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Random => "Random",
            Self::Meta => "Meta",
            Self::Njr15 => "NJR15",
            Self::Ours => "Ours",
            Self::Optimum => "Optimum",
        }
    }

    /// The one that learns less than Ours: the paper compares Linear with NJR15.
    pub(crate) fn baseline(model: ModelKind) -> Self {
        match model {
            ModelKind::Linear => Self::Njr15,
            _ => Self::Meta,
        }
    }

    /// Those that the paper compares.
    pub(crate) fn rivals(model: ModelKind) -> [Self; 3] {
        [Self::Random, Self::baseline(model), Self::Ours]
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
        let training = TrainingRun::of(self).name();
        match self.approach {
            Approach::Optimum => format!("{}-optimum{}", self.model.name(), bases(self)),
            Approach::Ours => format!("{training}-ours"),
            Approach::Meta => format!("{training}-on-random"),
            Approach::Random | Approach::Njr15 => {
                let title = self.approach.title().to_lowercase();
                let (model, n) = (self.model.name(), self.samples);
                format!("{model}-n{n}{}-{title}", bases(self))
            }
        }
    }
}

fn bases(case: &Case) -> String {
    match (case.model, case.prior) {
        (ModelKind::Linear, Prior { components, eta }) => {
            let eta = eta.map_or_else(|| "learned".to_owned(), |eta| eta.to_string());
            format!("-m{components}-eta-{eta}")
        }
        _ => String::new(),
    }
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
    /// What a case needs.
    pub(crate) fn of(case: &Case) -> Self {
        Self {
            model: case.model,
            samples: case.samples,
            schedule: Schedule::Joint,
            parts: match case.approach {
                Approach::Meta => Parts::WithoutPattern,
                _ => Parts::All,
            },
            prior: case.prior,
            repetition: 0,
            only: None,
        }
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
        name += &bases(&Case {
            prior: self.prior,
            ..Case::new(Approach::Ours, self.model, self.samples)
        });
        name += match self.parts {
            Parts::All => "",
            Parts::AllTwice => "-twice",
            Parts::WithoutPattern => "-meta",
            Parts::PatternOnly(_) => "-pattern",
        };
        if self.schedule == Schedule::Paper {
            name += "-paper";
        }
        if let Some((subset, _)) = &self.only {
            name += &format!("-{subset}");
        }
        match self.repetition {
            0 => name,
            repetition => format!("{name}-seed{repetition}"),
        }
    }
}
