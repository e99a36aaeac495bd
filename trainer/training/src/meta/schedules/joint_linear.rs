//! The schedule `joint` for the model Linear.

use crate::meta::initialization::initial_guess;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// Returns the plan. It trains precisions and pattern together, starting from the best of several patterns. A few steps
/// are enough to compare patterns.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (patterns, search_steps, final_steps) = match effort {
        Effort::Brief => (2, 100, 300),
        Effort::Quick => (3, 250, 1_000),
        Effort::Standard => (8, 1_000, 6_000),
        Effort::Long => (24, 2_000, 30_000),
    };
    let joint = Phase {
        name: "pattern search",
        initialization: Initialization::Previous,
        search: SearchMethod::Gradient,
        selection: Selection::BestValidation,
        samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: search_steps,
        batch: 16,
        inner_samples: InnerSamples::Pattern,
        outer_samples: 256,
        rates: Groups {
            initial: 0.0,
            hyperparameters: 3e-2,
            pattern: 3e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.02,
        warm_up_steps: 0,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        augmentation_gain: None,
    };
    let mut phases: Vec<Phase> = (0..patterns)
        .map(|guess| Phase {
            initialization: Initialization::Guess(guess),
            ..joint.clone()
        })
        .collect();
    phases.push(Phase {
        name: "best pattern",
        initialization: Initialization::Best,
        steps: final_steps,
        rates: Groups {
            initial: 0.0,
            hyperparameters: 1.5e-2,
            pattern: 1.5e-2,
            ..Groups::default()
        },
        ..joint
    });
    Plan {
        phases,
        tasks,
        initial_parameters: initial_guess,
        step_size_encoding: StepSizeEncoding::Logarithm,
        initial_step_size: 0.0,
        loss_weights: LossWeights::Equal,
        pretrained: None,
    }
}
