//! Schedule joint for models of many parameters.

use super::doubling::{UNDOUBLED, doubled};
use crate::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use crate::meta::start::first_guess;
use glimpse_optimizer::Groups;

/// Which of several starts is good shows only after a while, and not by its training loss: each
/// is trained for a short time, and the one that does best on unseen materials goes on.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let initial = 1e-3;
    let (starts, first, second, last, gentle, generations) = match effort {
        Effort::Brief => (2, 300, 600, 2_500, 0.5, 40),
        Effort::Quick => (3, 500, 1_500, 12_000, 0.5, 150),
        Effort::Standard => (6, 1_000, 4_000, 40_000, 0.3, 500),
        Effort::Long => (12, 2_000, 8_000, 240_000, 0.3, 2_000),
    };
    let wanted = samples;
    let samples = wanted.min(UNDOUBLED);
    let learning = Phase {
        name: "trying starts",
        start: Start::Previous,
        search: SearchMethod::Gradient,
        keep: Selection::Nothing,
        samples,
        added: AddedSamples::Sobol,
        in_order: false,
        steps: first,
        batch: 32,
        // More than n: a few random samples alone say too little to begin on.
        inner: InnerSamples::Random(samples.max(32)),
        outer: 256,
        rates: Groups {
            initial,
            hyperparameters: 1e-2,
            pattern: 0.0,
            ..Groups::default()
        },
        final_rate: 0.3,
        warm_up: 100,
        largest_norm: 0.1,
        weight_decay: 0.0,
        gain: Some(1.5),
    };
    let sampling = Phase {
        keep: Selection::BestValidation,
        steps: second,
        inner: InnerSamples::Pattern,
        rates: Groups {
            initial,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
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
    let lasting = Phase {
        name: "the best start",
        start: Start::Best,
        steps: last,
        // At the rates above a long run wanders off to worse places.
        rates: Groups {
            initial: gentle * initial,
            hyperparameters: gentle * 1e-2,
            pattern: gentle * 1e-2,
            ..Groups::default()
        },
        final_rate: 0.01,
        warm_up: 200,
        ..sampling.clone()
    };
    phases.push(lasting.clone());
    phases.push(Phase {
        name: "evolving the pattern",
        start: Start::Best,
        search: SearchMethod::Evolution(24),
        steps: generations,
        outer: 512,
        rates: Groups {
            pattern: 0.1,
            ..Groups::default()
        },
        gain: None,
        ..sampling
    });
    // A step takes the longer the more samples there are, and brings less.
    phases.extend(doubled(samples, wanted).map(|samples| Phase {
        name: "twice the samples",
        samples,
        added: AddedSamples::Jittered,
        steps: last / 8,
        ..lasting.clone()
    }));
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 3e-3,
        weighing: LossWeights::Relative,
        known: None,
    }
}
