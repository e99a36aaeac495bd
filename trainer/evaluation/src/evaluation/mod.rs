//! Evaluation of methods: fits to a few samples of each material, compared with the material at many directions.

mod adam;
mod adaptive;
mod estimate;
mod evaluator;
mod ggx;
mod leakage;
mod method;
mod outcome;
mod reader;
mod report;
mod target;

pub use adam::OPTIMUM_STEPS;
pub use adaptive::Adaptive;
pub use estimate::Estimate;
pub use evaluator::{Evaluator, SPHERE_SIZE, compare};
pub use ggx::Ggx;
pub use leakage::TrainingOverlap;
pub use method::{LINEAR_OPTIMUM_DIRECTIONS, Method, SampleDirections, names};
pub use outcome::{Forecast, Outcome};
pub use reader::{Degradation, Reader};
pub use report::{EvaluationReport, MaterialMetrics, PredictionQuality, UnseenLoss};
pub use target::{TargetReport, TargetScan};

use glimpse_materials::setting::Name;

/// An error of evaluating a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// A recipe of the model Linear lacks its basis, or a recipe was given another one.
    #[error(
        "the recipe lacks its basis, or has another one; give the basis that was written with it, which only the model linear \
         has"
    )]
    Basis,
    /// All starts of a fit diverged.
    #[error("the fit diverged; give another seed")]
    Diverged,
    /// A recipe that completes readings was given other directions than its own.
    #[error(
        "a recipe that completes readings works only at its own directions; give one that was trained with {} paper",
        Name("schedule")
    )]
    OtherDirections,
    /// Readings are missing, and the recipe needs all of them.
    #[error(
        "the recipe needs all of its readings; for scans with missing readings, train a recipe with {} 0.5",
        Name("missing")
    )]
    NeedsAllReadings,
    /// A share of a degradation is out of range.
    #[error("{name} must be 0 to 1, not {1}", name = Name(.0))]
    Share(&'static str, f32),
    /// A degradation leaves no readings to fit.
    #[error(
        "{} {lost} of {} {first} leaves no reading to fit; drop fewer, or use more",
        Name("lose"),
        Name("first")
    )]
    NoReadings {
        /// The number of readings.
        first: usize,
        /// The number of readings to drop.
        lost: usize,
    },
    /// The requested number of leading readings exceeds the recipe's samples.
    #[error(
        "the first {first} readings are requested, but the recipe has {samples}; request at most {samples}"
    )]
    TooFewReadings {
        /// The requested number.
        first: usize,
        /// The number of the recipe's samples.
        samples: usize,
    },
    /// A material cannot be scanned with a recipe.
    #[error(transparent)]
    Scan(#[from] glimpse_core::error::Error),
    /// A recipe has no upper bounds of the loss for scans that end early.
    #[error(
        "the recipe has no bounds of the loss for scans that end early; train one with {} 0.5, at least 2 samples and 10 \
         materials",
        Name("missing")
    )]
    NoPartialBound,
    /// A recipe has samples that exceed its own limits.
    #[error("the recipe has samples that exceed its own limits; train it again")]
    Unreachable,
    /// The caller stopped the evaluation.
    #[error("stopped before all materials were evaluated")]
    Stopped,
}
