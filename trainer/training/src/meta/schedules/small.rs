//! Schedule joint for models of a few parameters.

use super::doubling::{UNDOUBLED, doubled};
use crate::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use crate::meta::start::first_guess;
use glimpse_optimizer::Groups;

/// Each of several starts follows its gradient for a while and then
/// evolves; the fittest one evolves on. Many samples make every start look like every other: they
/// come from doubling a pattern, as in the paper.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (starts, descent, first, last) = match effort {
        Effort::Brief => (2, 300, 50, 100),
        Effort::Quick => (3, 800, 150, 400),
        Effort::Standard => (8, 2_000, 500, 1_500),
        Effort::Long => (32, 4_000, 800, 4_000),
    };
    let wanted = samples;
    let samples = wanted.min(UNDOUBLED);
    let descending = Phase {
        name: "trying starts",
        start: Start::Previous,
        search: SearchMethod::Gradient,
        keep: Selection::Nothing,
        samples,
        added: AddedSamples::Sobol,
        in_order: false,
        steps: descent,
        batch: 16,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            initial: 3e-3,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
        },
        final_rate: 0.1,
        warm_up: 100,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: Some(1.2),
    };
    let evolving = Phase {
        name: "evolving starts",
        search: SearchMethod::Evolution(24),
        added: AddedSamples::Repeated,
        keep: Selection::Fittest,
        steps: first,
        outer: 512,
        rates: Groups {
            initial: 0.1,
            hyperparameters: 0.1,
            pattern: 0.1,
            ..Groups::default()
        },
        gain: None,
        ..descending.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..starts {
        phases.push(Phase {
            start: Start::Guess(guess),
            ..descending.clone()
        });
        phases.push(evolving.clone());
    }
    phases.push(Phase {
        name: "evolving the fittest",
        start: Start::Best,
        steps: last,
        ..evolving.clone()
    });
    phases.extend(doubled(samples, wanted).map(|samples| Phase {
        name: "evolving twice the samples",
        start: Start::Best,
        samples,
        steps: first,
        ..evolving.clone()
    }));
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 0.3,
        weighing: LossWeights::Relative,
        known: None,
    }
}
