//! What a phase of training is; which phases there are, [`plan`](super::plan) says.

use glimpse_optimizer::Groups;

/// What the inner loop learns on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerSamples {
    /// So many fresh uniform samples at every step.
    Fresh(usize),
    /// So many uniform samples, the same at every step.
    Random(usize),
    /// The pattern's samples, the same at every step.
    Pattern,
}

/// Where a phase's meta-parameters come from. All but [`Start::Previous`] reset Adam's moments.
///
/// Where the phase has more samples than those, some are [`AddedSamples`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// A first guess of its own, by this number.
    Guess(u64),
    /// The phase before.
    Previous,
    /// The best meta-parameters so far; see [`Selection`].
    Best,
    /// The same, the samples in the order in which they tell most; see
    /// [`MetaObjective::in_order`](super::objective::MetaObjective::in_order).
    BestInOrder,
    /// The phase before, but for the pattern: another random one at each epoch.
    Patterns,
}

/// The samples that a phase has more than the one it begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedSamples {
    /// Points of a Sobol sequence.
    Sobol,
    /// Copies of those that there are. A pattern with every sample twice has the loss of the pattern
    /// with each once, so that evolution begins from what was reached. It is not for gradients: two
    /// equal samples have equal gradients, and would stay equal.
    Repeated,
    /// Copies of those that there are, each moved at random by a degree or two: for gradients, which
    /// then differ between a sample and its copy.
    Jittered,
}

/// Which of a phase's meta-parameters are the best so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// None of them: the best so far stays what it was.
    Nothing,
    /// Those with the best loss on materials held out, if it is better than before.
    BestValidation,
    /// Those of the epoch with the best training loss, barrier included, whatever there was before.
    BestEpoch,
    /// Those at its end.
    Last,
    /// Those at its end, if their [fitness](super::objective::MetaObjective::fitness) is better than before.
    Fittest,
}

/// How meta-parameters are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchMethod {
    /// Steps of Adam along exact meta-gradients of batches.
    Gradient,
    /// [Evolution](super::evolution) by the loss of all materials. A step is a generation of so
    /// many candidates, and [`Phase::rates`] are the standard deviations that it begins with.
    Evolution(usize),
}

/// One stage of meta-training.
#[derive(Clone, Debug)]
pub struct Phase {
    /// For progress reports.
    pub name: &'static str,
    /// Where it begins.
    pub start: Start,
    /// How it looks for better ones.
    pub search: SearchMethod,
    /// Which meta-parameters it hands on as the best.
    pub keep: Selection,
    /// How many samples the pattern has.
    pub samples: usize,
    /// Those that it begins with.
    pub added: AddedSamples,
    /// Whether a scan that ends early has the first samples. Before samples are in order, it may have any
    /// of them. (By schedule prior, where readings may be missing.)
    pub in_order: bool,
    /// Outer steps.
    pub steps: usize,
    /// Tasks in each.
    pub batch: usize,
    /// What to learn on.
    pub inner: InnerSamples,
    /// How many samples to judge by.
    pub outer: usize,
    /// Learning rates at its start; 0 freezes a group.
    pub rates: Groups<f64>,
    /// Learning rates at its end, as a share of those at its start (cosine annealing).
    pub final_rate: f64,
    /// Steps over which the rates rise to their start.
    pub warm_up: usize,
    /// Gradients of each group are scaled down to at most this norm.
    pub largest_norm: f32,
    /// Weight decay as in Adam with L2 regularisation: so much of a value is added to its gradient.
    pub weight_decay: f32,
    /// Train on [random variations](super::augmentation::Augmentation::random) with this gain rather than on the
    /// materials as they are.
    pub gain: Option<f32>,
}

impl Phase {
    /// The learning rates at a step.
    #[must_use]
    pub fn rates_at(&self, step: usize) -> Groups<f64> {
        let done = step as f64 / self.steps as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
        let annealed = self.final_rate + (1.0 - self.final_rate) * cosine;
        let risen = ((step + 1) as f64 / self.warm_up.max(1) as f64).min(1.0);
        let share = annealed * risen;
        self.rates.clone().map(|rate| rate * share)
    }
}

/// One outer step of a plan.
#[derive(Clone, Copy, Debug)]
pub struct OuterStep<'p> {
    /// The phase that it belongs to.
    pub phase: &'p Phase,
    /// Which of the plan's phases that is: it has random numbers of its own.
    pub number: usize,
    /// Which of the phase's steps it is.
    pub step: usize,
}

/// What is optimized for the step sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSizeForm {
    /// alpha itself, of any sign, as in the paper.
    Plain,
    /// ln alpha: alpha stays positive, and Adam's steps are relative.
    Logarithm,
}

impl StepSizeForm {
    /// alpha of what is optimized.
    #[must_use]
    pub fn step_sizes(self, values: &[f32]) -> Vec<f32> {
        match self {
            Self::Plain => values.to_vec(),
            Self::Logarithm => values.iter().map(|log| log.exp()).collect(),
        }
    }

    /// What is optimized for an alpha.
    #[must_use]
    pub fn value(self, step_size: f32) -> f32 {
        match self {
            Self::Plain => step_size,
            Self::Logarithm => step_size.ln(),
        }
    }

    /// From the gradient by alpha to the one by what is optimized.
    pub(super) fn chain(self, gradient: &mut [f32], step_sizes: &[f32]) {
        if self == Self::Logarithm {
            for (gradient, step_size) in gradient.iter_mut().zip(step_sizes) {
                *gradient *= step_size;
            }
        }
    }
}
