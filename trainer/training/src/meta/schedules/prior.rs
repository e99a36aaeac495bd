//! Schedule prior: a completion of readings, and what it starts, together with the pattern.

use glimpse_core::model::ModelKind;

use crate::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use crate::meta::plan::{Effort, LossWeights, Plan};
use crate::meta::start::first_guess;
use glimpse_optimizer::Groups;

/// How many steps an effort takes.
struct Steps {
    /// Patterns that are tried, and for how long each.
    patterns: u64,
    trying: usize,
    /// With the best one.
    completion_options: usize,
    /// For a model that descends.
    starting: usize,
    /// What its rates are multiplied by: a long training ends better by low ones.
    slower: f64,
    /// The last two for each fold.
    fold: [usize; 2],
}

impl Steps {
    fn of(effort: Effort, model: ModelKind) -> Self {
        let (patterns, trying, completion_options, starting, fold) = match (effort, descends(model))
        {
            (Effort::Brief, _) => (1, 0, 1_000, 800, [250, 200]),
            (Effort::Quick, true) => (2, 500, 4_000, 2_500, [400, 300]),
            (Effort::Quick, false) => (2, 500, 6_000, 0, [1_500, 0]),
            (Effort::Standard, true) => (6, 1_500, 40_000, 60_000, [4_000, 3_000]),
            (Effort::Standard, false) => (16, 3_000, 80_000, 0, [10_000, 0]),
            (Effort::Long, _) => (16, 3_000, 200_000, 150_000, [20_000, 20_000]),
        };
        Self {
            patterns,
            trying,
            completion_options,
            starting,
            slower: match effort {
                Effort::Brief | Effort::Quick => 1.0,
                Effort::Standard | Effort::Long => 0.25,
            },
            fold,
        }
    }
}

fn descends(model: ModelKind) -> bool {
    model != ModelKind::Linear
}

/// A pattern is tried, with a completion of its own.
fn trying(samples: usize, steps: usize) -> Phase {
    Phase {
        name: "trying patterns",
        start: Start::Previous,
        search: SearchMethod::Gradient,
        keep: Selection::BestValidation,
        samples,
        added: AddedSamples::Sobol,
        in_order: false,
        steps,
        batch: 32,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            pattern: 3e-2,
            completion: 5e-3,
            ..Groups::default()
        },
        final_rate: 0.1,
        warm_up: 100,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: None,
    }
}

/// A completion by itself; where a start follows, it ends sooner, and at a higher rate.
fn completion_options(model: ModelKind, samples: usize, steps: usize) -> Phase {
    Phase {
        name: "completing readings",
        in_order: true,
        keep: Selection::Last,
        steps: if descends(model) { steps / 2 } else { steps },
        final_rate: if descends(model) { 0.3 } else { 0.01 },
        ..trying(samples, steps)
    }
}

/// What a completion starts, and all that was there before with it.
fn starting(samples: usize, steps: usize, slower: f64) -> Phase {
    Phase {
        name: "starting descents",
        start: Start::Best,
        in_order: true,
        keep: Selection::Last,
        rates: Groups {
            initial: slower * 1e-3,
            hyperparameters: slower * 1e-2,
            pattern: 1e-2,
            completion: 1.5e-3,
            start: slower * 3e-3,
        },
        final_rate: 0.01,
        ..trying(samples, steps)
    }
}

fn plan_of(phases: Vec<Phase>, model: ModelKind, tasks: usize) -> Plan {
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: match model {
            ModelKind::Neural => 3e-3,
            _ => 0.1,
        },
        weighing: LossWeights::Relative,
        known: None,
    }
}

/// Several patterns are tried, each with a completion of its own; the best goes on, in the order that
/// serves scans that end early. (Where none is tried, samples stay as they come.) For a model that
/// descends its start is trained then, and all that was there before with it.
pub(super) fn plan(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let steps = Steps::of(effort, model);
    let mut phases: Vec<Phase> = (0..steps.patterns)
        .filter(|_| steps.trying > 0)
        .map(|guess| Phase {
            start: Start::Guess(guess),
            ..trying(samples, steps.trying)
        })
        .collect();
    phases.push(Phase {
        start: match phases.is_empty() {
            true => Start::Previous,
            false => Start::BestInOrder,
        },
        ..completion_options(model, samples, steps.completion_options)
    });
    if descends(model) {
        phases.push(starting(samples, steps.starting, steps.slower));
    }
    plan_of(phases, model, tasks)
}

/// The same for a fold, at a pattern that stays.
pub(super) fn fold(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let [first, then] = Steps::of(effort, model).fold;
    let mut phases = vec![Phase {
        start: Start::Guess(0),
        ..completion_options(
            model,
            samples,
            if descends(model) { 2 * first } else { first },
        )
    }];
    if descends(model) {
        phases.push(starting(samples, then, 1.0));
    }
    for phase in &mut phases {
        phase.name = "judging by folds";
        phase.rates.pattern = 0.0;
    }
    plan_of(phases, model, tasks)
}
