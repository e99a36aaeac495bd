//! The gradient of a chunk of tasks.

use glimpse_kernels::completion::Batch;

use super::hyperparameters::Hyperparameters;
use super::refinement::RefinementGradient;
use crate::linear::add_scaled;
use crate::meta::phase::Values;

/// The sum of losses of tasks, and its gradient.
pub(super) struct GradientSum {
    pub(super) loss: f32,
    /// The gradient of all groups but the hyperparameters.
    pub(super) values: Values,
    pub(super) hyperparameters: Hyperparameters,
}

impl GradientSum {
    /// Returns an empty sum.
    pub(super) fn new(values: &Values, hyperparameters: &Hyperparameters) -> Self {
        Self {
            loss: 0.0,
            values: values.as_ref().map(|list| vec![0.0; list.len()]),
            hyperparameters: hyperparameters.zeros(),
        }
    }

    /// Adds the gradient of a task's refinement with respect to initial parameters and hyperparameters, and sets that with
    /// respect to the StartNet's output.
    pub(super) fn add_refined(
        &mut self,
        batch: &mut Batch,
        index: usize,
        weight: f32,
        refined: &RefinementGradient,
    ) {
        add_scaled(&mut self.values.initial, weight, &refined.initial);
        if let Some(by_steps) = &mut self.hyperparameters.steps {
            by_steps.add_scaled(weight, &refined.hyperparameters);
        }
        let by_offsets = refined.initial.iter().map(|derivative| weight * derivative);
        batch.set_offset_gradient(index, by_offsets);
    }

    /// Returns the loss and the gradient with respect to the logarithms of hyperparameters.
    pub(super) fn finish(mut self, hyperparameters: &Hyperparameters) -> (f32, Values) {
        self.values.hyperparameters = hyperparameters.by_logarithms(&self.hyperparameters);
        (self.loss, self.values)
    }
}
