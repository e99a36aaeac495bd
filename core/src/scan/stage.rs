//! Stages of a scan.

use super::residual::Residual;
use crate::fit::Channels;

/// Stage of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Channels are taken; the fit's words hold nothing.
    Reading,
    /// A fit is under way.
    Fitting(Fitting),
    /// The fit is complete and was checked.
    Fitted(Residual),
}

/// A fit under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitting {
    /// Units of work done.
    pub(super) done: u32,
    pub(super) channels: Channels,
    /// Weight of a sample that counts: 1 / (3 n).
    pub(super) weight: f32,
}
