//! The fit of a model, in slices of work.

use super::method::FitMethod;
use crate::error::{Error, ErrorCode};
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, EPSILON};
use crate::model::{ModelKind, Samples};

/// The fit of a model, for [`Scan`](crate::scan::Scan). Its functions may change in any version.
///
/// Values are a model's parameters in its order, or Linear's coefficients: m for red, m for green, m for blue. A fit
/// uses a list of numbers, `words`, as its memory. [`Algorithm::words`] returns its length. With fewer words, nothing
/// is fitted.
pub trait Algorithm {
    /// Returns the memory of a fit, in words and without the samples.
    ///
    /// # Errors
    /// [`ErrorCode::Model`] if the recipe is for another model.
    fn words(method: &FitMethod<'_>, samples: usize) -> Result<usize, Error>;

    /// Returns the number of units of work of the whole fit.
    fn total(method: &FitMethod<'_>, samples: usize) -> u32;

    /// Initializes `words` for a fit.
    fn start(words: &mut [f32], method: &FitMethod<'_>, channels: Channels);

    /// Does at most `budget` units of work after the first `done`, and returns the new number of completed units.
    ///
    /// The result of the fit does not depend on the budgets.
    fn advance(
        words: &mut [f32],
        method: &FitMethod<'_>,
        samples: Samples<'_>,
        channels: Channels,
        done: u32,
        budget: u32,
    ) -> u32;

    /// Returns the current values: the parameters in the first list, or the coefficients of each channel.
    fn values<'w>(words: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; 3];

    /// Returns the loss of the complete fit, predicted from its readings, without the factor of its residual. None if the
    /// recipe has no prediction.
    ///
    /// If the coefficients of a completion are not finite, a model that descends returns NaN even without a prediction.
    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32>;

    /// Returns the innovation of the complete fit: the mean difference of logarithms between the readings and the
    /// completion before its correction. None without a correction.
    fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32>;

    /// Returns the modeled BRDF (linear RGB, sr^-1, not times the cosine) at a sample of the pattern.
    fn at_sample(
        words: &[f32],
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3];

    /// Returns the modeled BRDF (linear RGB, sr^-1, not times the cosine) anywhere above the horizon. None for Linear
    /// without a basis.
    fn brdf(
        words: &[f32],
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]>;
}

/// The channels of a fit's readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Three channels.
    Color,
    /// The channels of each reading are equal: the fitted material is gray, to the bit.
    Gray,
}

impl FitMethod<'_> {
    /// Returns the smallest BRDF y (sr^-1) that the loss or the mapping accepts at the pattern's sample with this
    /// index.
    ///
    /// A dark-subtracted reading may be below 0, but the argument of the logarithm has to stay positive. At the bound,
    /// 1 + y cos(theta_i) is 1/2, or Linear's y w + e is e / 2.
    #[must_use]
    pub fn min_reading(&self, index: usize, at: &HalfDifference<f32>) -> f32 {
        match self {
            Self::Descent(_) => -0.5 / at.cos_theta_i(),
            Self::Ridge(ridge) => {
                let weight = ridge.weight.iter().nth(index).unwrap_or(1.0);
                -0.5 * EPSILON as f32 / weight
            }
            // Both bounds, because a descent may follow.
            Self::Completed(_) => {
                let weight = at.cos_theta_i() * at.cos_theta_o();
                (-0.5 * EPSILON as f32 / weight).max(-0.5 / at.cos_theta_i())
            }
        }
    }
}

/// Returns the error of a recipe for another model than the firmware's.
pub(super) fn wrong_model(firmware: ModelKind, recipe: ModelKind) -> Error {
    Error::with(ErrorCode::Model, [firmware as u32, recipe as u32])
}

/// Returns true if all values of a list are finite. Not inlined, because it is called for each list.
#[inline(never)]
pub(crate) fn is_finite(list: &[f32]) -> bool {
    list.iter().all(|value| value.is_finite())
}
