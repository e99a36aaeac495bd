//! Schedules: what is trained when, for how long, at which rates.

use glimpse_core::model::ModelKind;

use super::parameters::Groups;
use super::training::{InnerSamples, Phase, StepSizeForm};

/// How the parts of a recipe are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Schedule {
    /// Initialisation and step sizes for the n at hand, then those and the pattern together.
    Joint,
    /// The paper's two stages: initialisation and step sizes on fresh samples, then the pattern
    /// alone.
    Paper,
}

/// How long to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// Seconds: to try things out. (Schedule paper: 1/100 of the paper's steps.)
    Quick,
    /// Minutes: for use. (Schedule paper: 1/10.)
    Standard,
    /// An hour or so: for the last few per cent. (Schedule paper: all of the paper's steps.)
    Long,
}

/// A whole training run, but for the materials.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The phases, in order. The last one trains for the n at hand.
    pub phases: Vec<Phase>,
    /// What is optimized for the step sizes.
    pub step_size_form: StepSizeForm,
    /// The step size that all parameters begin with.
    pub first_step_size: f32,
}

impl Plan {
    /// The plan for a model and a number of samples; `tasks` is the number of materials.
    #[must_use]
    pub fn new(
        schedule: Schedule,
        effort: Effort,
        model: ModelKind,
        samples: usize,
        tasks: usize,
    ) -> Self {
        match schedule {
            Schedule::Joint => joint(effort, model, samples),
            Schedule::Paper => paper(effort, tasks),
        }
    }

    /// The initialisation phases alone: what the method Meta trains.
    #[must_use]
    pub fn without_pattern(mut self) -> Self {
        self.phases
            .retain(|phase| phase.inner != InnerSamples::Pattern);
        self
    }

    /// Outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }
}

fn joint(effort: Effort, model: ModelKind, samples: usize) -> Plan {
    let (first, second) = match effort {
        Effort::Quick => (400, 3_000),
        Effort::Standard => (1_000, 16_000),
        Effort::Long => (5_000, 150_000),
    };
    let (initial, first_step_size) = match model {
        ModelKind::Neural => (1e-3, 1e-2),
        ModelKind::Phong => (3e-3, 0.3),
    };
    let phase = Phase {
        name: "start and step sizes",
        steps: first,
        batch: 16,
        // More than n: a few random samples alone say too little to begin on.
        inner: InnerSamples::Random(samples.max(32)),
        outer: 256,
        rates: Groups {
            initial,
            step_sizes: 1e-2,
            pattern: 0.0,
        },
        final_rate: 0.3,
        warm_up: 100,
        gain: Some(1.5),
    };
    Plan {
        step_size_form: StepSizeForm::Logarithm,
        first_step_size,
        phases: vec![
            phase.clone(),
            Phase {
                name: "pattern, start and step sizes",
                steps: second,
                inner: InnerSamples::Pattern,
                rates: Groups {
                    initial,
                    step_sizes: 1e-2,
                    pattern: 1e-2,
                },
                final_rate: 0.02,
                warm_up: 200,
                ..phase
            },
        ],
    }
}

/// The paper's settings: 10,000 and 500 epochs of one task a step.
fn paper(effort: Effort, tasks: usize) -> Plan {
    let share = match effort {
        Effort::Quick => 100,
        Effort::Standard => 10,
        Effort::Long => 1,
    };
    Plan {
        step_size_form: StepSizeForm::Plain,
        first_step_size: 1e-3,
        phases: vec![
            Phase {
                name: "start and step sizes",
                steps: 10_000 * tasks / share,
                batch: 1,
                inner: InnerSamples::Fresh(512),
                outer: 512,
                rates: Groups {
                    initial: 1e-4,
                    step_sizes: 1e-4,
                    pattern: 0.0,
                },
                final_rate: 1.0,
                warm_up: 0,
                gain: None,
            },
            Phase {
                name: "pattern",
                steps: 500 * tasks / share,
                batch: 1,
                inner: InnerSamples::Pattern,
                outer: 25_000,
                rates: Groups {
                    initial: 0.0,
                    step_sizes: 0.0,
                    pattern: 5e-4,
                },
                final_rate: 0.2,
                warm_up: 0,
                gain: None,
            },
        ],
    }
}
