//! A phase of training. [`plan`](super::plan) combines phases.

use glimpse_optimizer::Groups;

/// The samples of the inner loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerSamples {
    /// A number of uniform samples, redrawn at every inner step.
    Fresh(usize),
    /// A number of uniform samples, the same at every inner step.
    Fixed(usize),
    /// The samples of the pattern, the same at every inner step.
    Pattern,
}

/// The initial meta-parameters of a phase. All variants except [`Initialization::Previous`] reset Adam's moments.
///
/// If the phase has more samples than the pattern in these meta-parameters, the missing samples are added; see
/// [`AddedSamples`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initialization {
    /// An independent initial guess with this index, which selects its random numbers.
    Guess(u64),
    /// The final meta-parameters of the previous phase.
    Previous,
    /// The best meta-parameters so far; see [`Selection`].
    Best,
    /// The best meta-parameters so far, with the samples sorted by importance; see
    /// [`MetaObjective::reorder_samples`](super::objective::MetaObjective::reorder_samples).
    BestReordered,
    /// The best meta-parameters so far, with the best of several draws of initial parameters; see
    /// [`MetaObjective::choose_initial`](super::objective::MetaObjective::choose_initial).
    BestRedrawn,
    /// The final meta-parameters of the previous phase, but a new random pattern at each epoch.
    RandomPatterns,
}

/// The initial values of additional samples, in a phase with more samples than its initialization.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedSamples {
    /// Points of a Sobol sequence.
    Sobol,
    /// Copies of the existing samples. A pattern that contains every sample twice has the same loss, so evolution
    /// starts from the loss already reached. Unsuitable for gradient search: equal samples have equal gradients and
    /// stay equal.
    Repeated,
    /// Copies of the existing samples, each randomly displaced by one or two degrees. Suitable for gradient search: a
    /// sample and its copy have different gradients.
    Jittered,
}

/// The criterion for storing meta-parameters of a phase as the best so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// None: the phase leaves the best so far unchanged.
    Unchanged,
    /// The smallest loss on validation materials, if it is below the best so far.
    BestValidation,
    /// The smallest training loss over an epoch, including the [barrier](super::pattern::Pattern::barrier). Results of
    /// earlier phases are discarded.
    BestEpoch,
    /// The final meta-parameters.
    Last,
    /// The final meta-parameters, if their [fitness](super::objective::MetaObjective::fitness) is below the best loss
    /// so far.
    BestFitness,
}

/// The search for better meta-parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchMethod {
    /// Adam on exact meta-gradients of batches.
    Gradient,
    /// [Evolution](super::evolution) with the loss of all materials. A step is a generation of this many candidates,
    /// and [`Phase::rates`] are the initial standard deviations.
    Evolution(usize),
}

/// One stage of meta-training.
#[derive(Clone, Debug)]
pub struct Phase {
    /// The name in progress reports.
    pub name: &'static str,
    /// The initialization.
    pub initialization: Initialization,
    /// The search method.
    pub search: SearchMethod,
    /// The selection of the best meta-parameters.
    pub selection: Selection,
    /// The number of samples of the pattern.
    pub samples: usize,
    /// The initial values of additional samples.
    pub added_samples: AddedSamples,
    /// True if the samples are sorted by importance. Missing readings are then mostly the last ones, as in a scan that
    /// ends early; otherwise they are arbitrary. Affects only the schedule `prior`, if readings are
    /// missing.
    pub samples_ordered: bool,
    /// The number of outer steps.
    pub steps: usize,
    /// The number of tasks per outer step.
    pub batch: usize,
    /// The samples of the inner loop.
    pub inner_samples: InnerSamples,
    /// The number of samples of the outer loss.
    pub outer_samples: usize,
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
    /// The gain of [random augmentations](super::augmentation::Augmentation::random). None trains on the unchanged
    /// materials.
    pub augmentation_gain: Option<f32>,
}

impl Phase {
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
}

/// One outer step of a plan.
#[derive(Clone, Copy, Debug)]
pub struct OuterStep<'p> {
    /// The phase.
    pub phase: &'p Phase,
    /// The index of the phase in the plan; it selects the random numbers.
    pub phase_index: usize,
    /// The index of the step in the phase.
    pub step: usize,
}

/// The encoding of the step sizes in the meta-parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSizeEncoding {
    /// alpha, of any sign, as in the paper.
    Plain,
    /// ln alpha: alpha stays positive, and Adam's steps are relative.
    Logarithm,
}

impl StepSizeEncoding {
    /// Returns alpha, given encoded values.
    #[must_use]
    pub fn decode(self, values: &[f32]) -> Vec<f32> {
        match self {
            Self::Plain => values.to_vec(),
            Self::Logarithm => values.iter().map(|log| log.exp()).collect(),
        }
    }

    /// Returns the encoded value of an alpha.
    #[must_use]
    pub fn encode(self, step_size: f32) -> f32 {
        match self {
            Self::Plain => step_size,
            Self::Logarithm => step_size.ln(),
        }
    }

    /// Converts the gradient with respect to alpha to the gradient with respect to the encoded values.
    pub(super) fn chain_rule(self, gradient: &mut [f32], step_sizes: &[f32]) {
        if self == Self::Logarithm {
            for (gradient, step_size) in gradient.iter_mut().zip(step_sizes) {
                *gradient *= step_size;
            }
        }
    }
}
