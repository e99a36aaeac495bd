//! The objective of schedule paper, with one implementation for models fitted by SGD and one for Linear.

use glimpse_fitting::recipe::expected_loss::LossEstimate;

use crate::outer::{MetaValues, OuterStep};

/// The samples of the inner loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InnerSamples {
    /// A number of uniform samples, redrawn at every inner step.
    Fresh(usize),
    /// The samples of the pattern, the same at every inner step.
    Pattern,
}

/// The samples of a task's loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LossSamples {
    /// The samples of the inner loop.
    pub inner: InnerSamples,
    /// The number of samples of the outer loss.
    pub outer: usize,
}

/// A differentiable function of the meta-parameters of schedule paper, evaluated on batches of tasks.
pub trait PaperObjective: Sync {
    /// Returns initial meta-parameters.
    fn initial_values(&self) -> MetaValues;

    /// Returns the mean outer loss over a step's batch of tasks, and its gradient. The gradient includes the
    /// [barrier](crate::pattern::SamplePattern::barrier), the loss does not.
    fn gradient(
        &self,
        values: &MetaValues,
        outer_step: OuterStep,
        samples: LossSamples,
    ) -> (f32, MetaValues);

    /// Returns the mean loss on the validation materials: an estimate for an unseen material.
    fn expected_loss(&self, values: &MetaValues) -> LossEstimate;
}
