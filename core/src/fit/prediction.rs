//! The predicted loss of a fit.
//!
//! With a_k the mean over the three channels of coefficient k, s the innovation (the mean of |t| of the ridge stage over
//! present readings and channels) and r the mean error of the fit at its readings, the predicted loss is
//!
//! ```text
//! exp(q_0 + sum over k of q_k a_k + partial_loss_k) (s + 0.001)^innovation (r + 0.0001)^residual
//! ```

use crate::numeric::Floats;
use crate::numeric::math::{exp, ln};
use crate::section::section;

section! {
    /// The predicted loss of a fit, and its upper bound, which holds for 90 % of materials.
    Prediction<'a> = 128, "prediction" {
        /// q_0, and then q_1 to q_m
        weights: Floats<'a>, [Weights], in -1e4 => 1e4;
        /// exponent of the innovation
        innovation: f32, in -100.0 => 100.0;
        /// exponent of the residual
        residual: f32, in -100.0 => 100.0;
        /// ratio of the upper bound to the predicted loss
        bound: f32, in f32::MIN_POSITIVE => f32::MAX;
        /// largest innovation of a material like those of the training
        max_innovation: f32, in f32::MIN_POSITIVE => f32::MAX;
        /// for each number of readings from 1 to n the logarithm of a factor; empty for none
        partial_loss: Floats<'a>, [Samples], optional true, in -100.0 => 100.0;
        /// for each number of readings the ratio of the upper bound; empty if it is always the same
        partial_bound: Floats<'a>, [Samples], optional true, in f32::MIN_POSITIVE => f32::MAX;
    }
}

/// Added to the innovation, so that 0 has a logarithm.
pub const MIN_INNOVATION: f32 = 1e-3;
/// Added to the residual.
pub const MIN_RESIDUAL: f32 = 1e-4;

/// The predicted loss of a fit.
pub(crate) struct PredictedLoss {
    pub(crate) loss: f32,
    /// The upper bound.
    pub(crate) bound: f32,
    /// True if the innovation exceeds that of all training materials.
    pub(crate) is_unlike_training: bool,
}

impl Prediction<'_> {
    /// Returns the predicted loss. Not inlined, because it runs once per fit.
    #[inline(never)]
    pub(super) fn loss(
        &self,
        [red, green, blue]: [&[f32]; 3],
        innovation: f32,
        residual: f32,
        readings: u16,
    ) -> PredictedLoss {
        let mut sum = self.weights.get(0);
        let weights = self.weights.iter().skip(1);
        for (weight, ((red, green), blue)) in weights.zip(red.iter().zip(green).zip(blue)) {
            sum += weight * (red + green + blue) * (1.0 / 3.0);
        }
        sum += self.innovation * ln(innovation + MIN_INNOVATION);
        sum += self.residual * ln(residual + MIN_RESIDUAL);
        let index = usize::from(readings).saturating_sub(1);
        sum += self.partial_loss.get(index);
        let ratio = match self.partial_bound.is_empty() {
            true => self.bound,
            false => self.partial_bound.get(index),
        };
        let loss = exp(sum);
        PredictedLoss {
            loss,
            bound: loss * ratio,
            is_unlike_training: innovation > self.max_innovation,
        }
    }
}
