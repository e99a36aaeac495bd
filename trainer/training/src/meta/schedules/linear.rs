//! Schedule joint for Linear.

use crate::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use crate::meta::start::first_guess;
use glimpse_optimizer::Groups;

/// Precisions and pattern together, from the best of several patterns: which of them is good shows
/// early.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (starts, first, last) = match effort {
        Effort::Brief => (2, 100, 300),
        Effort::Quick => (3, 250, 1_000),
        Effort::Standard => (8, 1_000, 6_000),
        Effort::Long => (24, 2_000, 30_000),
    };
    let sampling = Phase {
        name: "trying patterns",
        start: Start::Previous,
        search: SearchMethod::Gradient,
        keep: Selection::BestValidation,
        samples,
        added: AddedSamples::Sobol,
        in_order: false,
        steps: first,
        batch: 16,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            initial: 0.0,
            hyperparameters: 3e-2,
            pattern: 3e-2,
            ..Groups::default()
        },
        final_rate: 0.02,
        warm_up: 0,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: None,
    };
    let mut phases: Vec<Phase> = (0..starts)
        .map(|guess| Phase {
            start: Start::Guess(guess),
            ..sampling.clone()
        })
        .collect();
    phases.push(Phase {
        name: "the best pattern",
        start: Start::Best,
        steps: last,
        rates: Groups {
            initial: 0.0,
            hyperparameters: 1.5e-2,
            pattern: 1.5e-2,
            ..Groups::default()
        },
        ..sampling
    });
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 0.0,
        weighing: LossWeights::Equal,
        known: None,
    }
}
