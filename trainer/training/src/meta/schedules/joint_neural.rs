//! The schedule `joint` for the model Neural.

use super::doubling::{MAX_UNDOUBLED, doubled};
use crate::meta::initialization::initial_guess;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// Returns the plan. It trains several initializations for some steps, and continues with the one that has the smallest
/// validation loss. Fewer steps, or the training loss, would not identify the best initialization.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let initial_rate = 1e-3;
    let (initializations, parameter_steps, joint_steps, final_steps, rate_factor, generations) =
        match effort {
            Effort::Brief => (2, 300, 600, 2_500, 0.5, 40),
            Effort::Quick => (3, 500, 1_500, 12_000, 0.5, 150),
            Effort::Standard => (6, 1_000, 4_000, 40_000, 0.3, 500),
            Effort::Long => (12, 2_000, 8_000, 240_000, 0.3, 2_000),
        };
    let first_samples = samples.min(MAX_UNDOUBLED);
    let parameters = Phase {
        name: "initialization search",
        initialization: Initialization::Previous,
        search: SearchMethod::Gradient,
        selection: Selection::Unchanged,
        samples: first_samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: parameter_steps,
        batch: 32,
        // At least 32 samples: at the beginning, fewer random samples give too little information.
        inner_samples: InnerSamples::Fixed(first_samples.max(32)),
        outer_samples: 256,
        rates: Groups {
            initial: initial_rate,
            hyperparameters: 1e-2,
            pattern: 0.0,
            ..Groups::default()
        },
        final_rate_ratio: 0.3,
        warm_up_steps: 100,
        max_gradient_norm: 0.1,
        weight_decay: 0.0,
        augmentation_gain: Some(1.5),
    };
    let joint = Phase {
        selection: Selection::BestValidation,
        steps: joint_steps,
        inner_samples: InnerSamples::Pattern,
        rates: Groups {
            initial: initial_rate,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.1,
        ..parameters.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..initializations {
        phases.push(Phase {
            initialization: Initialization::Guess(guess),
            ..parameters.clone()
        });
        phases.push(joint.clone());
    }
    let long = Phase {
        name: "best initialization",
        initialization: Initialization::Best,
        steps: final_steps,
        // Long runs at the rates above diverge from good solutions.
        rates: Groups {
            initial: rate_factor * initial_rate,
            hyperparameters: rate_factor * 1e-2,
            pattern: rate_factor * 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.01,
        warm_up_steps: 200,
        ..joint.clone()
    };
    phases.push(long.clone());
    phases.push(Phase {
        name: "pattern evolution",
        initialization: Initialization::Best,
        search: SearchMethod::Evolution(24),
        steps: generations,
        outer_samples: 512,
        rates: Groups {
            pattern: 0.1,
            ..Groups::default()
        },
        augmentation_gain: None,
        ..joint
    });
    // Each doubling makes steps slower and less effective.
    phases.extend(doubled(first_samples, samples).map(|samples| Phase {
        name: "doubled pattern",
        samples,
        added_samples: AddedSamples::Jittered,
        steps: final_steps / 8,
        ..long.clone()
    }));
    Plan {
        phases,
        tasks,
        initial_parameters: initial_guess,
        step_size_encoding: StepSizeEncoding::Logarithm,
        initial_step_size: 3e-3,
        loss_weights: LossWeights::Relative,
        pretrained: None,
    }
}
