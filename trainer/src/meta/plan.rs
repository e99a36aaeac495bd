//! Schedules: what is trained when, for how long, at which rates.

use glimpse_core::model::ModelKind;

use super::parameters::Groups;
use super::training::{InnerSamples, Phase, Start, StepSizeForm};

/// How the parts of a recipe are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Schedule {
    /// Start, step sizes and pattern together, for the n at hand, from the best of several tries.
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

    /// What the method Meta trains: all but the pattern. Where start and step sizes would learn
    /// on the pattern they learn on as many random samples.
    #[must_use]
    pub fn without_pattern(mut self, samples: usize) -> Self {
        self.phases
            .retain(|phase| phase.inner != InnerSamples::Pattern || phase.rates.initial > 0.0);
        for phase in &mut self.phases {
            if phase.inner == InnerSamples::Pattern {
                phase.inner = InnerSamples::Random(samples);
                phase.rates.pattern = 0.0;
            }
        }
        self
    }

    /// Outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }
}

/// Which of several starts is good shows only after a while, and not by its training loss: each
/// is trained for a short time, and the one that does best on unseen materials goes on.
fn joint(effort: Effort, model: ModelKind, samples: usize) -> Plan {
    let (starts, first, second, last, gentle) = match effort {
        Effort::Quick => (3, 300, 800, 2_500, 1.0),
        Effort::Standard => (4, 1_000, 3_000, 14_000, 0.3),
        Effort::Long => (12, 2_000, 8_000, 120_000, 0.3),
    };
    let (initial, first_step_size) = match model {
        ModelKind::Neural => (1e-3, 3e-3),
        ModelKind::Phong | ModelKind::CookTorrance => (3e-3, 0.3),
        // Never descends: `train` refuses it.
        ModelKind::Linear => (0.0, 0.0),
    };
    let learning = Phase {
        name: "trying starts",
        start: Start::Previous,
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
    let sampling = Phase {
        steps: second,
        inner: InnerSamples::Pattern,
        rates: Groups {
            initial,
            step_sizes: 1e-2,
            pattern: 1e-2,
        },
        final_rate: 0.1,
        ..learning.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..starts {
        phases.push(Phase {
            start: Start::Guess(guess),
            ..learning.clone()
        });
        phases.push(sampling.clone());
    }
    phases.push(Phase {
        name: "the best start",
        start: Start::Best,
        steps: last,
        // At the rates above a long run wanders off to worse places.
        rates: Groups {
            initial: gentle * initial,
            step_sizes: gentle * 1e-2,
            pattern: gentle * 1e-2,
        },
        final_rate: 0.01,
        warm_up: 200,
        ..sampling
    });
    Plan {
        step_size_form: StepSizeForm::Logarithm,
        first_step_size,
        phases,
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
                start: Start::Guess(0),
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
                start: Start::Previous,
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
