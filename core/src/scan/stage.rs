//! Stages of a scan.

use super::plausibility::Albedo;
use super::residual::{Residual, ResidualSum};
use crate::fit::Channels;

/// Stage of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Readings are being recorded. The workspace is unused.
    Reading,
    /// A fit is in progress.
    Fitting(Fitting),
    /// The fit of this number of readings is complete and was checked.
    Fitted { residual: Residual, readings: u16 },
}

/// A fit in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitting {
    /// Number of completed units of work.
    pub(super) done: u32,
    pub(super) channels: Channels,
    /// Number of readings that count in the fit.
    pub(super) readings: u16,
    pub(super) checks: Checks,
}

/// The checks of a fit, as far as they are done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Checks {
    /// True if a value or a prediction is not finite.
    pub(super) has_overflowed: bool,
    pub(super) sum: ResidualSum,
    pub(super) albedo: Albedo,
}

impl Fitting {
    /// Weight of a reading that counts.
    pub(super) fn weight(&self) -> f32 {
        1.0 / (3.0 * f32::from(self.readings))
    }
}
