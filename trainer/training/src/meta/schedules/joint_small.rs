//! The schedule `joint` for models with few parameters: Phong and Cook-Torrance.

use super::doubling::{MAX_UNDOUBLED, doubled};
use crate::meta::initialization::initial_guess;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// Returns the plan. It trains several initializations, each by gradients and then by evolution, and continues the
/// evolution of the one with the smallest loss.
///
/// With many samples, all initializations lead to similar results. Large patterns are therefore built by doubling, as
/// in the paper.
pub(super) fn plan(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (initializations, gradient_steps, search_generations, final_generations) = match effort {
        Effort::Brief => (2, 300, 50, 100),
        Effort::Quick => (3, 800, 150, 400),
        Effort::Standard => (8, 2_000, 500, 1_500),
        Effort::Long => (32, 4_000, 800, 4_000),
    };
    let first_samples = samples.min(MAX_UNDOUBLED);
    let gradient = Phase {
        name: "initialization search",
        initialization: Initialization::Previous,
        search: SearchMethod::Gradient,
        selection: Selection::Unchanged,
        samples: first_samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: gradient_steps,
        batch: 16,
        inner_samples: InnerSamples::Pattern,
        outer_samples: 256,
        rates: Groups {
            initial: 3e-3,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.1,
        warm_up_steps: 100,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        augmentation_gain: Some(1.2),
    };
    let evolution = Phase {
        name: "initialization evolution",
        search: SearchMethod::Evolution(24),
        added_samples: AddedSamples::Repeated,
        selection: Selection::BestFitness,
        steps: search_generations,
        outer_samples: 512,
        rates: Groups {
            initial: 0.1,
            hyperparameters: 0.1,
            pattern: 0.1,
            ..Groups::default()
        },
        augmentation_gain: None,
        ..gradient.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..initializations {
        phases.push(Phase {
            initialization: Initialization::Guess(guess),
            ..gradient.clone()
        });
        phases.push(evolution.clone());
    }
    phases.push(Phase {
        name: "evolution of the best initialization",
        initialization: Initialization::Best,
        steps: final_generations,
        ..evolution.clone()
    });
    phases.extend(doubled(first_samples, samples).map(|samples| Phase {
        name: "evolution of the doubled pattern",
        initialization: Initialization::Best,
        samples,
        steps: search_generations,
        ..evolution.clone()
    }));
    Plan {
        phases,
        tasks,
        initial_parameters: initial_guess,
        step_size_encoding: StepSizeEncoding::Logarithm,
        initial_step_size: 0.3,
        loss_weights: LossWeights::Relative,
        pretrained: None,
    }
}
