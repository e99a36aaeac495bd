//! Losses of tasks with their weights.

/// The loss of a task, with its weight.
#[derive(Clone, Copy)]
pub(super) struct WeightedLoss {
    pub(super) loss: f32,
    pub(super) weight: f32,
}

/// Returns the weight of a task's loss, given the loss of black (f = 0) on its material, to which it is about inverse: the
/// loss of a dark material is always small, but its errors are visible in pictures.
pub(super) fn task_weight(loss_of_black: f32) -> f32 {
    /// Limits the weight of a black material to (`MEAN` + `OFFSET`) / `OFFSET` = 13.
    const OFFSET: f32 = 0.005;
    /// The approximate mean loss of black over materials, so that a typical weight is 1.
    const MEAN: f32 = 0.06;
    (MEAN + OFFSET) / (loss_of_black + OFFSET)
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
