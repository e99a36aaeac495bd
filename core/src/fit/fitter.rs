//! The models that a scan can name.

use serde::{Deserialize, Serialize};

use super::algorithm::Algorithm;
use super::any::AnyModel;
use super::linear::Linear;
use crate::model::{CookTorrance, Neural, Phong};

/// A model that a scan can name: one of the four, or [`AnyModel`], which does what the recipe says.
pub trait Fitter: Algorithm {}

impl Fitter for Phong {}
impl Fitter for CookTorrance {}
impl Fitter for Neural {}
impl Fitter for Linear {}
impl Fitter for AnyModel {}

/// Progress of a fit, in its own units of work: gradients of one sample, rows and channels of a
/// ridge solve, or what a completion makes of one reading or for one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Units done.
    pub done: u32,
    /// Units that the whole fit takes.
    pub total: u32,
}

impl Progress {
    /// True if nothing is left to do.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }
}
