//! Schedule prior: a completion of readings, and what it starts, together with the pattern.

use glimpse_core::model::ModelKind;

use crate::meta::phase::{Added, InnerSamples, Keep, Phase, Search, Start, StepSizeForm};
use crate::meta::plan::{Effort, Plan, Weighing};
use crate::meta::start::first_guess;
use glimpse_optimizer::Groups;

/// Several patterns are tried, each with a completion of its own; the best goes on. For a model that
/// descends its start is trained then, and all that was there before with it.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let (starts, first, completing, starting) = match effort {
        Effort::Brief => (1, 0, 1_000, 800),
        Effort::Quick => (2, 500, 4_000, 2_500),
        Effort::Standard => (6, 1_500, 20_000, 20_000),
        Effort::Long => (16, 3_000, 100_000, 150_000),
    };
    let descends = model != ModelKind::Linear;
    let trying = Phase {
        name: "trying patterns",
        start: Start::Previous,
        search: Search::Gradient,
        keep: Keep::BestValidation,
        samples,
        added: Added::Sobol,
        steps: first,
        batch: 32,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            pattern: 3e-2,
            completion: 5e-3,
            ..Groups::default()
        },
        final_rate: 0.1,
        warm_up: 100,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: None,
    };
    let mut phases: Vec<Phase> = (0..starts)
        .filter(|_| first > 0)
        .map(|guess| Phase {
            start: Start::Guess(guess),
            ..trying.clone()
        })
        .collect();
    phases.push(Phase {
        name: "completing readings",
        start: Start::Best,
        keep: Keep::Last,
        steps: if descends { completing / 2 } else { completing },
        final_rate: if descends { 0.3 } else { 0.01 },
        ..trying.clone()
    });
    if descends {
        phases.push(Phase {
            name: "starting descents",
            start: Start::Best,
            keep: Keep::Last,
            steps: starting,
            rates: Groups {
                initial: 1e-3,
                hyperparameters: 1e-2,
                pattern: 1e-2,
                completion: 1.5e-3,
                start: 3e-3,
            },
            final_rate: 0.01,
            ..trying
        });
    }
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: if model == ModelKind::Neural {
            3e-3
        } else {
            0.1
        },
        weighing: Weighing::Relative,
        known: None,
    }
}
