//! The lengths of trainings.

use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::Effort;
use glimpse_materials::rows;
use serde::Deserialize;

/// The step counts of an effort.
#[derive(Deserialize)]
pub(super) struct Steps {
    effort: Effort,
    /// True for Linear.
    is_linear: bool,
    /// The number of directions of a task's loss, at a pattern.
    pub(super) outer_samples: usize,
    /// The number of patterns in the search; 0 without a search.
    pub(super) patterns: u64,
    /// The number of steps for each pattern in the search.
    pub(super) search: usize,
    /// The number of steps of the CoefficientNet phase.
    pub(super) coefficient_net: usize,
    /// The number of steps of the StartNet phase; 0 for Linear.
    pub(super) start_net: usize,
    /// The same for random directions.
    pub(super) random_start_net: usize,
    /// The number of steps of the CoefficientNet and StartNet phases in each fold.
    pub(super) fold: [usize; 2],
}

impl Steps {
    pub(super) fn of(effort: Effort, model: ModelKind) -> Self {
        let mut all = rows::<Self>(include_str!("steps.csv")).into_iter();
        let is_linear = model == ModelKind::Linear;
        all.find(|steps| steps.effort == effort && steps.is_linear == is_linear)
            .expect("each effort has two rows")
    }
}
