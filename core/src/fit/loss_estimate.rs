//! The evidence for the loss of a completed fit: its readings, and their number.

use serde::{Deserialize, Serialize};

use crate::numeric::Floats;

/// The evidence of the readings for the loss of a fit.
///
/// The predicted loss is that of the coefficients times (s + 1e-3)^`innovation` (r + 1e-4)^`residual`. s is the
/// [innovation](super::correction::Correction), and r is the mean residual of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// The exponent of the innovation.
    pub innovation: f32,
    /// The exponent of the residual.
    pub residual: f32,
    /// The ratio of the upper bound to the predicted loss. The bound holds for 90 % of materials.
    pub bound: f32,
    /// The largest innovation of a material like those of the training.
    pub max_innovation: f32,
}

impl Uncertainty {
    /// Added to the innovation, so that 0 has a logarithm.
    pub const MIN_INNOVATION: f32 = 1e-3;
    /// Added to the residual.
    pub const MIN_RESIDUAL: f32 = 1e-4;
}

/// The loss of fits with some of the readings, in addition to an [`Uncertainty`]. Without one, it has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartialLoss<'a> {
    pub(crate) loss: Floats<'a>,
    pub(crate) bound: Floats<'a>,
}

impl<'a> PartialLoss<'a> {
    /// The logarithm of a factor of the predicted loss, for each number of readings from 1 to n.
    #[must_use]
    pub fn loss(&self) -> Floats<'a> {
        self.loss
    }

    /// The ratio of the upper bound to the predicted loss, for each number of readings from 1 to n. It replaces
    /// [`Uncertainty::bound`].
    #[must_use]
    pub fn bound(&self) -> Floats<'a> {
        self.bound
    }
}
