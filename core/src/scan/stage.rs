//! Stages of a scan.

use super::residual::Residual;
use crate::fit::Channels;

/// Stage of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Readings are being recorded. The workspace is unused.
    Reading,
    /// A fit is in progress.
    Fitting(Fitting),
    /// The fit is complete and was checked.
    Fitted(Residual),
}

/// A fit in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitting {
    /// Number of completed units of work.
    pub(super) done: u32,
    pub(super) channels: Channels,
    /// Weight of a sample that counts: 1 / (3 n).
    pub(super) weight: f32,
}
