//! Losses of tasks with their weights.

/// The loss of a task, with its weight.
#[derive(Clone, Copy)]
pub(super) struct WeightedLoss {
    pub(super) loss: f32,
    pub(super) weight: f32,
}

/// Returns the mean of the products of losses and weights.
pub(super) fn weighted_mean(losses: &[WeightedLoss]) -> f32 {
    mean(losses.iter().map(|each| each.weight * each.loss))
}

/// Returns the mean of losses.
pub(super) fn mean(losses: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = losses.len() as f32;
    losses.sum::<f32>() / count
}
