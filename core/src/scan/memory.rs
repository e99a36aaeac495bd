//! The memory of a scan, which is the caller's.

use super::Residual;
use crate::fit::Fitter;
use crate::model::Sample;

/// All memory that scan and fit take: readings, and what the fit works in.
///
/// [`Memory::new`] is a constant, all zeros: in a static it costs no flash. One memory serves one
/// scan after the other, by the same recipe or by another.
pub struct Memory<K: Fitter, const CAPACITY: usize> {
    pub(super) samples: [Sample<f32>; CAPACITY],
    pub(super) status: [Status; CAPACITY],
    pub(super) stage: Stage,
    pub(super) workspace: K::Workspace,
}

impl<K: Fitter, const CAPACITY: usize> Memory<K, CAPACITY> {
    /// Nothing was read yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            samples: [Sample::ZERO; CAPACITY],
            status: [Status::PENDING; CAPACITY],
            stage: Stage::Reading,
            workspace: K::EMPTY,
        }
    }
}

impl<K: Fitter, const CAPACITY: usize> Default for Memory<K, CAPACITY> {
    fn default() -> Self {
        Self::new()
    }
}

/// What is going on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// Readings are taken; what the workspace holds means nothing.
    Reading,
    /// So many units of a fit are done.
    Fitting { done: u32 },
    /// The fit is done and was looked at.
    Fitted(Residual),
}

/// What is known of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(u8);

impl Status {
    /// It was not read yet.
    pub(super) const PENDING: Self = Self(0);
    const READ: u8 = 1;
    const SATURATED: u8 = 2;
    const CLAMPED: u8 = 4;

    /// It was read.
    pub(super) fn read(saturated: bool, clamped: bool) -> Self {
        let saturated = if saturated { Self::SATURATED } else { 0 };
        let clamped = if clamped { Self::CLAMPED } else { 0 };
        Self(Self::READ | saturated | clamped)
    }

    pub(super) fn is_saturated(self) -> bool {
        self.0 & Self::SATURATED != 0
    }

    pub(super) fn is_clamped(self) -> bool {
        self.0 & Self::CLAMPED != 0
    }
}
