//! The paper's schedule.

use glimpse_core::model::ModelKind;

use super::doubling::doubled;
use crate::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use crate::meta::start::random_start;
use glimpse_optimizer::Groups;

/// Of so many random patterns of one sample the best begins stage 2.
const GUESSES: usize = 50;

impl Effort {
    /// The paper's number of steps divided by that of schedule paper at this effort.
    #[must_use]
    pub fn divisor_of_the_paper_s_steps(self) -> usize {
        match self {
            Self::Brief => 500,
            Self::Quick => 100,
            Self::Standard => 10,
            Self::Long => 1,
        }
    }
}

/// The paper's settings. Stage 1: initialization and step sizes, 10,000 epochs. Stage 2: the
/// pattern, from the best of random guesses at n = 1, doubled until it has the n asked for, and
/// each n trained for 500 epochs. All of them with one task a step.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let share = effort.divisor_of_the_paper_s_steps();
    let (rate, final_rate) = match model {
        ModelKind::Linear => (1e-3, 0.5),
        _ => (5e-4, 0.2),
    };
    let mut phases = Vec::new();
    let first = Phase {
        name: "start and step sizes",
        start: Start::Guess(0),
        search: SearchMethod::Gradient,
        keep: Selection::Last,
        // No pattern yet, but Meta is judged on one.
        samples,
        added: AddedSamples::Sobol,
        in_order: false,
        steps: 10_000 / share * tasks,
        batch: 1,
        inner: InnerSamples::Fresh(512),
        outer: 512,
        rates: Groups {
            initial: 1e-4,
            hyperparameters: 1e-4,
            pattern: 0.0,
            ..Groups::default()
        },
        final_rate: 1.0,
        warm_up: 0,
        largest_norm: f32::INFINITY,
        weight_decay: 1e-6,
        gain: None,
    };
    let guesses = Phase {
        name: "guesses",
        start: Start::Patterns,
        keep: Selection::BestEpoch,
        samples: 1,
        steps: GUESSES * tasks,
        inner: InnerSamples::Pattern,
        outer: 25_000,
        rates: Groups::default(),
        weight_decay: 0.0,
        ..first.clone()
    };
    let pattern = Phase {
        name: "pattern",
        start: Start::Best,
        steps: 500 / share * tasks,
        rates: Groups {
            pattern: rate,
            ..Groups::default()
        },
        final_rate,
        ..guesses.clone()
    };
    if model != ModelKind::Linear {
        phases.push(first);
    }
    phases.push(guesses);
    let counts = std::iter::once(1).chain(doubled(1, samples));
    phases.extend(counts.map(|samples| Phase {
        samples,
        ..pattern.clone()
    }));
    Plan {
        phases,
        tasks,
        first_guess: random_start,
        step_size_form: StepSizeForm::Plain,
        first_step_size: 1e-3,
        weighing: LossWeights::Equal,
        known: None,
    }
}
