//! The models that a scan accepts as its type parameter.

use serde::{Deserialize, Serialize};

use super::algorithm::Algorithm;
use super::any::AnyModel;
use super::linear::Linear;
use crate::model::{CookTorrance, Neural, Phong};

/// A model that a scan accepts as its type parameter: one of the four, or [`AnyModel`] for the recipe's model.
pub trait Fitter: Algorithm {}

impl Fitter for Phong {}
impl Fitter for CookTorrance {}
impl Fitter for Neural {}
impl Fitter for Linear {}
impl Fitter for AnyModel {}

/// The progress of a fit, in units of work.
///
/// A unit is the gradient of one sample, a row or a channel of a ridge solve, or a part of the completion of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Number of completed units.
    pub done: u32,
    /// Number of units of the whole fit.
    pub total: u32,
}

impl Progress {
    /// Returns true if all units are completed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }
}
