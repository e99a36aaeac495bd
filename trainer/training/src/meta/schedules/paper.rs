//! The schedule of the paper.

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

/// The settings of the paper, with one task per step. Stage 1: initial parameters and step sizes, 10,000 epochs. Stage
/// 2: the pattern, from the best random pattern at n = 1, doubled until the requested n; 500 epochs for each n.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let share = effort.paper_step_divisor();
    let (rate, final_rate_ratio) = match model {
        ModelKind::Linear => (1e-3, 0.5),
        _ => (5e-4, 0.2),
    };
    let mut phases = Vec::new();
    let first = Phase {
        name: "initial parameters and step sizes",
        initialization: Initialization::Guess(0),
        search: SearchMethod::Gradient,
        selection: Selection::Last,
        // This stage has no pattern, but the method Meta is evaluated on one.
        samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: 10_000 / share * tasks,
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
    let guesses = Phase {
        name: "random patterns",
        initialization: Initialization::RandomPatterns,
        selection: Selection::BestEpoch,
        samples: 1,
        steps: RANDOM_PATTERNS * tasks,
        inner_samples: InnerSamples::Pattern,
        outer_samples: 25_000,
        rates: Groups::default(),
        weight_decay: 0.0,
        ..first.clone()
    };
    let pattern = Phase {
        name: "pattern",
        initialization: Initialization::Best,
        steps: 500 / share * tasks,
        rates: Groups {
            pattern: rate,
            ..Groups::default()
        },
        final_rate_ratio,
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
        initial_parameters: random_initialization,
        step_size_encoding: StepSizeEncoding::Plain,
        initial_step_size: 1e-3,
        loss_weights: LossWeights::Equal,
        pretrained: None,
    }
}
