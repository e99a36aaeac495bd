//! The schedule `prior`, which trains the CoefficientNet and the StartNet jointly with the pattern.

use glimpse_core::model::ModelKind;

use crate::meta::initialization::initial_guess;
use crate::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use glimpse_optimizer::Groups;

/// The step counts and learning rates of an effort.
struct EffortSettings {
    /// The number of patterns in the search; 0 without a search.
    patterns: u64,
    /// The number of steps for each pattern in the search.
    search_steps: usize,
    /// The number of steps of the CoefficientNet phase.
    coefficient_net_steps: usize,
    /// The number of steps of the StartNet phase; 0 for Linear.
    start_net_steps: usize,
    /// The number of steps of the CoefficientNet and StartNet phases in each fold.
    fold_steps: [usize; 2],
}

impl EffortSettings {
    fn new(effort: Effort, model: ModelKind) -> Self {
        let (patterns, search_steps, coefficient_net_steps, start_net_steps, fold_steps) =
            match (effort, has_start_net(model)) {
                (Effort::Brief, true) => (0, 0, 1_000, 400, [250, 100]),
                (Effort::Brief, false) => (0, 0, 1_000, 0, [250, 0]),
                (Effort::Quick, true) => (2, 500, 6_000, 2_500, [1_500, 1_000]),
                (Effort::Quick, false) => (2, 500, 6_000, 0, [1_500, 0]),
                (Effort::Standard, true) => (6, 1_500, 30_000, 4_000, [4_000, 2_500]),
                (Effort::Standard, false) => (16, 3_000, 80_000, 0, [10_000, 0]),
                (Effort::Long, true) => (16, 3_000, 100_000, 60_000, [20_000, 10_000]),
                (Effort::Long, false) => (16, 3_000, 200_000, 0, [20_000, 0]),
            };
        Self {
            patterns,
            search_steps,
            coefficient_net_steps,
            start_net_steps,
            fold_steps,
        }
    }
}

fn has_start_net(model: ModelKind) -> bool {
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
            hyperparameters: 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.1,
        warm_up_steps: 100,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        augmentation_gain: None,
    }
}

/// Returns the phase that trains the CoefficientNet without a StartNet.
fn coefficient_net(samples: usize, steps: usize) -> Phase {
    Phase {
        name: "coefficient network",
        samples_ordered: true,
        selection: Selection::Last,
        final_rate_ratio: 0.01,
        ..pattern_search(samples, steps)
    }
}

/// Returns the phase that trains the StartNet.
///
/// Neural can represent what the coefficients do, and is worse on other materials than the training set if they change.
/// For the models with few parameters, pattern and coefficients are trained again, for the fit.
fn start_net(model: ModelKind, samples: usize, steps: usize) -> Phase {
    let (pattern, coefficient_net) = match model {
        ModelKind::Neural => (0.0, 0.0),
        _ => (1e-2, 1.5e-3),
    };
    Phase {
        name: "initialization network",
        initialization: Initialization::BestRedrawn,
        samples_ordered: true,
        selection: Selection::Last,
        rates: Groups {
            initial: 1e-3,
            hyperparameters: 1e-2,
            pattern,
            coefficient_net,
            start_net: 3e-3,
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

/// Returns the plan of a training on all materials.
///
/// A search trains several patterns, each with its own CoefficientNet. The best pattern continues, with its samples
/// sorted for scans that end early. Without a search, the samples keep their order. For models other than Linear, a final
/// phase trains the StartNet.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let settings = EffortSettings::new(effort, model);
    let mut phases: Vec<Phase> = (0..settings.patterns)
        .map(|guess| Phase {
            initialization: Initialization::Guess(guess),
            ..pattern_search(samples, settings.search_steps)
        })
        .collect();
    phases.push(Phase {
        initialization: match phases.is_empty() {
            true => Initialization::Previous,
            false => Initialization::BestReordered,
        },
        ..coefficient_net(samples, settings.coefficient_net_steps)
    });
    if has_start_net(model) {
        phases.push(start_net(model, samples, settings.start_net_steps));
    }
    plan_of(phases, model, tasks)
}

/// Returns the plan of a cross-validation fold, at a fixed pattern.
pub(super) fn fold(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let [coefficient_net_steps, start_net_steps] = EffortSettings::new(effort, model).fold_steps;
    let mut phases = vec![Phase {
        initialization: Initialization::Guess(0),
        ..coefficient_net(samples, coefficient_net_steps)
    }];
    if has_start_net(model) {
        phases.push(start_net(model, samples, start_net_steps));
    }
    for phase in &mut phases {
        phase.name = "cross-validation";
        phase.rates.pattern = 0.0;
    }
    plan_of(phases, model, tasks)
}
