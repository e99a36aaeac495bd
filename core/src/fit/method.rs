//! The fit method of a recipe.
//!
//! [`Recipe::parse`](crate::recipe::Recipe::parse) creates it and checks its invariants. Its lists are read in place.

use super::completed::{Completed, Target, Uncertainty};
use super::learned::{Descent, Ridge};
use crate::model::ModelKind;

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

    /// The evidence of the readings for the loss of a fit. None if the recipe has none.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        match self {
            Self::Completed(completed) => completed.uncertainty,
            _ => None,
        }
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
