//! What tasks lose, and what they count for.

/// The loss of a task, and what it counts for in a weighed mean.
#[derive(Clone, Copy)]
pub(super) struct WeightedLoss {
    pub(super) loss: f32,
    pub(super) weight: f32,
}

/// The mean of losses, each times what it counts for.
pub(super) fn mean_weighed(judged: &[WeightedLoss]) -> f32 {
    mean(judged.iter().map(|each| each.weight * each.loss))
}

/// The mean of losses.
pub(super) fn mean(losses: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = losses.len() as f32;
    losses.sum::<f32>() / count
}
