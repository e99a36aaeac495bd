//! A phase of training: steps of Adam on the gradient of an objective. The schedules are lists of phases.

use glimpse_fitting::linear::add_scaled;
use glimpse_optimizer::Groups;

/// Meta-parameters, or their gradient.
pub type Values = Groups<Vec<f32>>;

/// Returns the sum of losses and gradients in their order, multiplied by `share`.
#[must_use]
pub fn scaled_sum(share: f32, tasks: &[(f32, Values)]) -> (f32, Values) {
    let mut loss = 0.0;
    let mut sum = Values::default();
    for (task_loss, gradients) in tasks {
        loss += share * task_loss;
        for (sum, gradient) in sum.each_mut().into_iter().zip(gradients.each()) {
            sum.resize(gradient.len(), 0.0);
            add_scaled(sum, share, gradient);
        }
    }
    (loss, sum)
}

/// An outer step. Phase and step select its random numbers.
#[derive(Clone, Copy, Debug)]
pub struct OuterStep {
    /// The index of the phase.
    pub phase_index: usize,
    /// The index of the step in the phase.
    pub step: usize,
    /// The number of tasks.
    pub batch: usize,
}

/// Returns the meta-parameters that a phase starts with, given the best ones so far, or the present ones without
/// them.
pub type Start<'a> = Box<dyn Fn(Values) -> Values + 'a>;
/// Returns the loss of a step, and its gradient, which includes the [barrier](super::pattern::Pattern::barrier).
pub type Gradient<'a> = Box<dyn Fn(&Values, OuterStep) -> (f32, Values) + 'a>;
/// Returns a loss, by which the best meta-parameters are selected.
pub type SelectionLoss<'a> = Box<dyn Fn(&Values) -> f32 + 'a>;

/// The criterion for storing meta-parameters of a phase as the best so far.
pub enum Selection<'a> {
    /// The smallest loss on validation materials, if it is below the best so far.
    BestValidation(SelectionLoss<'a>),
    /// The smallest training loss over an epoch of this many steps, including the
    /// [barrier](super::pattern::Pattern::barrier). Results of earlier phases are discarded.
    BestEpoch(usize),
    /// The final meta-parameters.
    Last,
}

/// One stage of meta-training.
pub struct Phase<'a> {
    /// The name in progress reports.
    pub name: &'static str,
    /// The number of samples of the pattern.
    pub samples: usize,
    /// The first meta-parameters, with new moments of Adam; None to continue the previous phase.
    pub start: Option<Start<'a>>,
    /// The objective.
    pub gradient: Gradient<'a>,
    /// The selection of the best meta-parameters.
    pub selection: Selection<'a>,
    /// The number of outer steps.
    pub steps: usize,
    /// The number of tasks per outer step.
    pub batch: usize,
    /// The initial learning rate of each group; 0 freezes a group.
    pub rates: Groups<f64>,
    /// The final learning rates, as a share of the initial ones (cosine annealing).
    pub final_rate_ratio: f64,
    /// The number of steps of linear warm-up.
    pub warm_up_steps: usize,
    /// The maximum norm of the gradient of each group; longer gradients are scaled down.
    pub max_gradient_norm: f32,
    /// The weight decay of Adam with L2 regularization: the share of a value added to its gradient.
    pub weight_decay: f32,
    /// The initial multiple of the budget for the time of a scan. Patterns spread before they contract.
    pub initial_allowance: f64,
}

/// The share of a phase after which the budget for the time of a scan is the given one.
const CONTRACTION: f64 = 0.4;

impl Phase<'_> {
    /// Returns the learning rates at a step.
    #[must_use]
    pub fn rates_at(&self, step: usize) -> Groups<f64> {
        let progress = step as f64 / self.steps as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * progress).cos());
        let annealed = self.final_rate_ratio + (1.0 - self.final_rate_ratio) * cosine;
        let warm_up = ((step + 1) as f64 / self.warm_up_steps.max(1) as f64).min(1.0);
        let share = annealed * warm_up;
        self.rates.clone().map(|rate| rate * share)
    }

    /// Returns the budget for the time of a scan at a step, as a multiple of the given one.
    #[must_use]
    pub fn allowance_at(&self, step: usize) -> f64 {
        let progress = step as f64 / self.steps as f64;
        1.0 + (self.initial_allowance - 1.0) * (1.0 - progress / CONTRACTION).max(0.0)
    }
}
