//! The models that a scan accepts as its type parameter.

use serde::{Deserialize, Serialize};

use super::algorithm::Algorithm;
use super::any::AnyModel;
use super::linear::Linear;
use crate::model::{CookTorrance, Neural, Phong};

/// A type that a scan accepts as its type parameter: one of the four models, or [`AnyModel`] for that of the recipe.
pub trait Fitter: Algorithm {}

impl Fitter for Phong {}
impl Fitter for CookTorrance {}
impl Fitter for Neural {}
impl Fitter for Linear {}
impl Fitter for AnyModel {}

/// The progress of a fit, in units of work.
///
/// Units differ in cost. A descent computes the gradient of one sample in a unit. A ridge solve computes a row of its
/// system, or the coefficients of a channel. A completion adds a reading to the net, or computes some of its results.
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
