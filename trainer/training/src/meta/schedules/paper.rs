//! The schedule `paper`: the two stages of the paper.

use glimpse_core::model::ModelKind;

use super::doubling::doubled;
use crate::meta::initialization::random_initialization;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// The number of random patterns of one sample; the best one starts stage 2.
const RANDOM_PATTERNS: usize = 50;

impl Effort {
    /// Returns the divisor of the paper's number of steps at this effort of schedule paper.
    #[must_use]
    pub fn paper_step_divisor(self) -> usize {
        match self {
            Self::Brief => 500,
            Self::Quick => 100,
            Self::Standard => 10,
            Self::Long => 1,
        }
    }
}

/// Returns the plan of the paper, with one task per step.
///
/// Stage 1 trains initial parameters and step sizes for 10,000 epochs. Stage 2 trains the pattern. It starts from the
/// best random pattern of one sample, and doubles it up to the requested n, with 500 epochs for each n.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let divisor = effort.paper_step_divisor();
    let (rate, final_rate_ratio) = match model {
        ModelKind::Linear => (1e-3, 0.5),
        _ => (5e-4, 0.2),
    };
    let mut phases = Vec::new();
    let parameters = Phase {
        name: "initial parameters and step sizes",
        initialization: Initialization::Guess(0),
        search: SearchMethod::Gradient,
        selection: Selection::Last,
        // This stage does not use the pattern, but the method Meta is evaluated at one.
        samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: 10_000 / divisor * tasks,
        batch: 1,
        inner_samples: InnerSamples::Fresh(512),
        outer_samples: 512,
        rates: Groups {
            initial: 1e-4,
            hyperparameters: 1e-4,
            pattern: 0.0,
            ..Groups::default()
        },
        final_rate_ratio: 1.0,
        warm_up_steps: 0,
        max_gradient_norm: f32::INFINITY,
        weight_decay: 1e-6,
        augmentation_gain: None,
    };
    let random_patterns = Phase {
        name: "random patterns",
        initialization: Initialization::RandomPatterns,
        selection: Selection::BestEpoch,
        samples: 1,
        steps: RANDOM_PATTERNS * tasks,
        inner_samples: InnerSamples::Pattern,
        outer_samples: 25_000,
        rates: Groups::default(),
        weight_decay: 0.0,
        ..parameters.clone()
    };
    let pattern = Phase {
        name: "pattern",
        initialization: Initialization::Best,
        steps: 500 / divisor * tasks,
        rates: Groups {
            pattern: rate,
            ..Groups::default()
        },
        final_rate_ratio,
        ..random_patterns.clone()
    };
    if model != ModelKind::Linear {
        phases.push(parameters);
    }
    phases.push(random_patterns);
    let counts = std::iter::once(1).chain(doubled(1, samples));
    phases.extend(counts.map(|samples| Phase {
        samples,
        ..pattern.clone()
    }));
    Plan {
        phases,
        tasks,
        initial_parameters: random_initialization,
        step_size_encoding: StepSizeEncoding::Plain,
        initial_step_size: 1e-3,
        loss_weights: LossWeights::Equal,
        pretrained: None,
    }
}
