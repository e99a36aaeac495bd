//! The phases of schedule prior, which trains the CoefficientNet with the pattern, and then the StartNet.

use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::Effort;
use glimpse_optimizer::Groups;

use super::objective::{OUTER_SAMPLES, PriorObjective, RANDOM_TASKS, StepOptions};
use crate::phase::{Gradient, Phase, Selection, Start};
use crate::tasks::task::Dropout;

/// The step counts of an effort.
struct Steps {
    /// The number of patterns in the search; 0 without a search.
    patterns: u64,
    /// The number of steps for each pattern in the search.
    search: usize,
    /// The number of steps of the CoefficientNet phase.
    coefficient_net: usize,
    /// The number of steps of the StartNet phase; 0 for Linear.
    start_net: usize,
    /// The number of steps of the CoefficientNet and StartNet phases in each fold.
    fold: [usize; 2],
}

impl Steps {
    fn new(effort: Effort, model: ModelKind) -> Self {
        let (patterns, search, coefficient_net, start_net, fold) =
            match (effort, model != ModelKind::Linear) {
                (Effort::Brief, true) => (0, 0, 1_000, 400, [250, 100]),
                (Effort::Brief, false) => (0, 0, 1_000, 0, [250, 0]),
                (Effort::Quick, true) => (2, 500, 6_000, 2_500, [1_500, 1_000]),
                (Effort::Quick, false) => (2, 500, 6_000, 0, [1_500, 0]),
                (Effort::Standard, true) => (4, 1_500, 30_000, 4_000, [2_000, 1_250]),
                (Effort::Standard, false) => (4, 3_000, 64_000, 0, [5_000, 0]),
                (Effort::Long, true) => (16, 3_000, 100_000, 60_000, [20_000, 10_000]),
                (Effort::Long, false) => (16, 3_000, 200_000, 0, [20_000, 0]),
            };
        Self {
            patterns,
            search,
            coefficient_net,
            start_net,
            fold,
        }
    }
}

/// Returns the number of outer steps of a training on all materials, and of each fold.
#[must_use]
pub fn step_counts(effort: Effort, model: ModelKind) -> [usize; 2] {
    let steps = Steps::new(effort, model);
    [
        steps.patterns as usize * steps.search + steps.coefficient_net + steps.start_net,
        steps.fold.iter().sum(),
    ]
}

/// Returns the gradient of a phase.
fn gradient<'a>(
    objective: &'a PriorObjective<'a>,
    dropout: Dropout,
    is_refined: bool,
) -> Gradient<'a> {
    let options = StepOptions {
        outer_samples: OUTER_SAMPLES,
        dropout,
        is_refined,
    };
    Box::new(move |values, step| objective.gradient(values, step, options))
}

/// Returns a phase of the pattern search: one pattern with its own CoefficientNet.
fn pattern_search<'a>(
    objective: &'a PriorObjective<'a>,
    steps: usize,
    start: Option<Start<'a>>,
) -> Phase<'a> {
    Phase {
        name: "pattern search",
        samples: objective.shape.samples,
        start,
        gradient: gradient(objective, Dropout::Any, false),
        selection: Selection::BestValidation(Box::new(|values| objective.selection_loss(values))),
        steps,
        batch: 32,
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
        initial_allowance: 3.0,
    }
}

/// Returns the phase that trains the CoefficientNet without a StartNet. Its samples are sorted for scans that end early.
fn coefficient_net<'a>(
    objective: &'a PriorObjective<'a>,
    steps: usize,
    start: Option<Start<'a>>,
) -> Phase<'a> {
    Phase {
        name: "coefficient network",
        gradient: gradient(objective, Dropout::TailOrFew, false),
        selection: Selection::Last,
        final_rate_ratio: 0.01,
        initial_allowance: 1.3,
        ..pattern_search(objective, steps, start)
    }
}

/// Returns the phase that trains the StartNet.
///
/// Neural can represent what the coefficients do, and is worse on other materials than the training set if they change.
/// For the models with few parameters, pattern and coefficients are trained again, for the fit.
fn start_net<'a>(objective: &'a PriorObjective<'a>, steps: usize) -> Phase<'a> {
    let (pattern, coefficient_net_rate) = match objective.model() {
        ModelKind::Neural => (0.0, 0.0),
        _ => (1e-2, 1.5e-3),
    };
    let start = Box::new(|best| objective.choose_initial(best));
    Phase {
        name: "start network",
        gradient: gradient(objective, Dropout::TailOrFew, true),
        rates: Groups {
            initial: 1e-3,
            hyperparameters: 1e-2,
            pattern,
            coefficient_net: coefficient_net_rate,
            start_net: 3e-3,
        },
        ..coefficient_net(objective, steps, Some(start))
    }
}

/// Returns the phases of a training on all materials.
///
/// A search trains several patterns, each with its own CoefficientNet. The best pattern continues, with its samples
/// sorted for scans that end early. Without a search, the samples keep their order. For models other than Linear, a final
/// phase trains the StartNet, which is the only phase for random directions.
#[must_use]
pub fn phases<'a>(objective: &'a PriorObjective<'a>, effort: Effort) -> Vec<Phase<'a>> {
    let steps = Steps::new(effort, objective.model());
    if objective.random_directions.is_some() {
        return vec![Phase {
            start: None,
            gradient: Box::new(|values, step| objective.gradient(values, step, RANDOM_TASKS)),
            ..start_net(objective, steps.start_net)
        }];
    }
    let search = (0..steps.patterns).map(|guess| {
        let start: Start<'a> = Box::new(move |_| objective.initial_values(guess));
        pattern_search(objective, steps.search, Some(start))
    });
    let mut phases: Vec<Phase<'a>> = search.collect();
    let reorder = || -> Start<'a> { Box::new(|best| objective.reorder_samples(best)) };
    let start = (!phases.is_empty()).then(reorder);
    phases.push(coefficient_net(objective, steps.coefficient_net, start));
    if steps.start_net > 0 {
        phases.push(start_net(objective, steps.start_net));
    }
    phases
}

/// Returns the phases of a cross-validation fold, at a fixed pattern. The resulting losses on the fold's materials, which
/// the run does not train on, estimate the loss on unseen materials.
#[must_use]
pub fn fold<'a>(objective: &'a PriorObjective<'a>, effort: Effort) -> Vec<Phase<'a>> {
    let [coefficient_net_steps, start_net_steps] = Steps::new(effort, objective.model()).fold;
    let mut phases = vec![coefficient_net(objective, coefficient_net_steps, None)];
    if start_net_steps > 0 {
        phases.push(start_net(objective, start_net_steps));
    }
    for phase in &mut phases {
        phase.name = "cross-validation";
        phase.rates.pattern = 0.0;
    }
    phases
}
