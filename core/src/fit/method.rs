//! The fit method of a recipe.
//!
//! [`Recipe::parse`](crate::recipe::Recipe::parse) creates it and checks its invariants. Its lists are read in place.

use super::completed::{Completed, Target};
use super::learned::{Descent, Ridge};
use super::loss_estimate::{PartialLoss, Uncertainty};
use crate::model::ModelKind;
use crate::numeric::Floats;
use crate::numeric::math::{exp, ln};

/// True if the crate fits recipes with a completion.
pub(crate) const COMPLETION: bool = cfg!(feature = "completion");
/// True if the crate fits recipes with a ridge solve.
pub(crate) const RIDGE: bool = cfg!(feature = "ridge");

/// The method that fits parameters to readings.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant)] // a scan has one, without an allocator
pub enum FitMethod<'a> {
    /// A few steps of SGD.
    Descent(Descent<'a>),
    /// A ridge solve, the model Linear.
    Ridge(Ridge<'a>),
    /// A completion, and the use of its coefficients.
    Completed(Completed<'a>),
}

impl FitMethod<'_> {
    /// The model that the method fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match self {
            Self::Descent(descent) => descent.model,
            Self::Ridge(_) => ModelKind::Linear,
            Self::Completed(completed) => completed.model(),
        }
    }

    /// The number of values of a fit: the model's parameters, or a coefficient for each component and channel.
    #[must_use]
    pub fn values(&self) -> usize {
        let components = match self {
            Self::Descent(descent) => return descent.initial.len(),
            Self::Ridge(ridge) => ridge.components(),
            Self::Completed(completed) => match &completed.target {
                Target::Linear(_) => completed.components(),
                Target::Descent(descent, _) => return descent.initial.len(),
                Target::GaussNewton(steps, _) => return steps.initial.len(),
            },
        };
        components.saturating_mul(3)
    }

    /// Returns true if a fit tolerates missing readings.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        match self {
            Self::Completed(completed) => completed.tolerates_missing(),
            _ => false,
        }
    }

    /// The CRC-32 of the host's whole basis file, which turns Linear's coefficients into a BRDF. None without a basis.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        match self {
            Self::Ridge(ridge) => ridge.basis_checksum(),
            Self::Completed(completed) => match &completed.target {
                Target::Linear(components) => components.basis_checksum(),
                Target::Descent(..) | Target::GaussNewton(..) => None,
            },
            Self::Descent(_) => None,
        }
    }
}

impl<'a> FitMethod<'a> {
    fn completed(&self) -> Option<&Completed<'a>> {
        match self {
            Self::Completed(completed) => Some(completed),
            _ => None,
        }
    }

    /// The evidence of the readings for the loss of a fit. None if the recipe has none.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        self.completed()?.uncertainty
    }

    /// Returns the factor of the predicted loss that the mean residual and the number of readings determine.
    pub(crate) fn loss_factor(&self, residual: f32, readings: u16) -> f32 {
        let Some(uncertainty) = self.uncertainty() else {
            return 1.0;
        };
        let exponent = uncertainty.residual * ln(residual + Uncertainty::MIN_RESIDUAL);
        let partial = self.partial(|partial| partial.loss, readings);
        exp(exponent + partial.unwrap_or_default())
    }

    /// Returns the ratio of the upper bound to the predicted loss for this number of readings. None without an
    /// [`Uncertainty`].
    pub(crate) fn bound_ratio(&self, readings: u16) -> Option<f32> {
        let uncertainty = self.uncertainty()?;
        let partial = self.partial(|partial| partial.bound, readings);
        Some(partial.unwrap_or(uncertainty.bound))
    }

    /// Returns the entry of a list of [`PartialLoss`] for this number of readings.
    fn partial(&self, list: fn(&PartialLoss<'a>) -> Floats<'a>, readings: u16) -> Option<f32> {
        let list = list(self.completed()?.partial.as_ref()?);
        let index = usize::from(readings).checked_sub(1)?;
        Some(f32::from_le_bytes(*list.words().get(index)?))
    }

    /// Returns true if the recipe bounds the loss of a fit with some of the readings.
    pub(crate) fn bounds_partial_loss(&self) -> bool {
        self.completed().is_some_and(|completed| {
            completed.tolerates_missing()
                && !completed.prediction.is_empty()
                && completed.uncertainty.is_some()
                && completed.partial.is_some()
        })
    }
}
