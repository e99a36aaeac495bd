//! Schedule prior: CoefficientNet and InitNet, trained jointly with the pattern.

use glimpse_core::model::ModelKind;

use crate::meta::initialization::initial_guess;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// The step counts of an effort.
struct StepCounts {
    /// The number of patterns in the search.
    patterns: u64,
    /// The steps of each pattern in the search.
    search_steps: usize,
    /// The steps of the CoefficientNet with the best pattern.
    coefficient_net_steps: usize,
    /// The steps of the InitNet, for models fitted by descent.
    init_net_steps: usize,
    /// The factor on the learning rates of the InitNet phase: long trainings end better with low rates.
    rate_factor: f64,
    /// The steps of CoefficientNet and InitNet in each fold.
    fold_steps: [usize; 2],
}

impl StepCounts {
    fn of(effort: Effort, model: ModelKind) -> Self {
        let (patterns, search_steps, coefficient_net_steps, init_net_steps, fold_steps) =
            match (effort, has_descent(model)) {
                (Effort::Brief, _) => (1, 0, 1_000, 800, [250, 200]),
                (Effort::Quick, true) => (2, 500, 4_000, 2_500, [400, 300]),
                (Effort::Quick, false) => (2, 500, 6_000, 0, [1_500, 0]),
                (Effort::Standard, true) => (6, 1_500, 40_000, 60_000, [4_000, 3_000]),
                (Effort::Standard, false) => (16, 3_000, 80_000, 0, [10_000, 0]),
                (Effort::Long, _) => (16, 3_000, 200_000, 150_000, [20_000, 20_000]),
            };
        Self {
            patterns,
            search_steps,
            coefficient_net_steps,
            init_net_steps,
            rate_factor: match effort {
                Effort::Brief | Effort::Quick => 1.0,
                Effort::Standard | Effort::Long => 0.25,
            },
            fold_steps,
        }
    }
}

fn has_descent(model: ModelKind) -> bool {
    model != ModelKind::Linear
}

/// Returns a phase of the pattern search: one pattern with its own CoefficientNet.
fn pattern_search(samples: usize, steps: usize) -> Phase {
    Phase {
        name: "pattern search",
        initialization: Initialization::Previous,
        search: SearchMethod::Gradient,
        selection: Selection::BestValidation,
        samples,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps,
        batch: 32,
        inner_samples: InnerSamples::Pattern,
        outer_samples: 256,
        rates: Groups {
            pattern: 3e-2,
            coefficient_net: 5e-3,
            ..Groups::default()
        },
        final_rate_ratio: 0.1,
        warm_up_steps: 100,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        augmentation_gain: None,
    }
}

/// Returns the phase of the CoefficientNet alone. Before an InitNet phase it has half the steps, and ends at a higher
/// rate.
fn coefficient_net(model: ModelKind, samples: usize, steps: usize) -> Phase {
    Phase {
        name: "coefficient network",
        samples_ordered: true,
        selection: Selection::Last,
        steps: if has_descent(model) { steps / 2 } else { steps },
        final_rate_ratio: if has_descent(model) { 0.3 } else { 0.01 },
        ..pattern_search(samples, steps)
    }
}

/// Returns the phase of the InitNet, which continues to train all other groups.
fn init_net(samples: usize, steps: usize, rate_factor: f64) -> Phase {
    Phase {
        name: "initialization network",
        initialization: Initialization::Best,
        samples_ordered: true,
        selection: Selection::Last,
        rates: Groups {
            initial: rate_factor * 1e-3,
            hyperparameters: rate_factor * 1e-2,
            pattern: 1e-2,
            coefficient_net: 1.5e-3,
            init_net: rate_factor * 3e-3,
        },
        final_rate_ratio: 0.01,
        ..pattern_search(samples, steps)
    }
}

fn plan_of(phases: Vec<Phase>, model: ModelKind, tasks: usize) -> Plan {
    Plan {
        phases,
        tasks,
        initial_parameters: initial_guess,
        step_size_encoding: StepSizeEncoding::Logarithm,
        initial_step_size: match model {
            ModelKind::Neural => 3e-3,
            _ => 0.1,
        },
        loss_weights: LossWeights::Relative,
        pretrained: None,
    }
}

/// Searches among several patterns, each with its own CoefficientNet, and continues with the best one. Its samples are
/// then sorted for scans that end early; without a search their order is kept. For models fitted by descent, a final
/// phase adds the InitNet and trains all groups.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let steps = StepCounts::of(effort, model);
    let mut phases: Vec<Phase> = (0..steps.patterns)
        .filter(|_| steps.search_steps > 0)
        .map(|guess| Phase {
            initialization: Initialization::Guess(guess),
            ..pattern_search(samples, steps.search_steps)
        })
        .collect();
    phases.push(Phase {
        initialization: match phases.is_empty() {
            true => Initialization::Previous,
            false => Initialization::BestReordered,
        },
        ..coefficient_net(model, samples, steps.coefficient_net_steps)
    });
    if has_descent(model) {
        phases.push(init_net(samples, steps.init_net_steps, steps.rate_factor));
    }
    plan_of(phases, model, tasks)
}

/// Returns the plan of a fold, at a fixed pattern.
pub(super) fn fold(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let [coefficient_net_steps, init_net_steps] = StepCounts::of(effort, model).fold_steps;
    let mut phases = vec![Phase {
        initialization: Initialization::Guess(0),
        ..coefficient_net(
            model,
            samples,
            if has_descent(model) {
                2 * coefficient_net_steps
            } else {
                coefficient_net_steps
            },
        )
    }];
    if has_descent(model) {
        phases.push(init_net(samples, init_net_steps, 1.0));
    }
    for phase in &mut phases {
        phase.name = "cross-validation";
        phase.rates.pattern = 0.0;
    }
    plan_of(phases, model, tasks)
}
