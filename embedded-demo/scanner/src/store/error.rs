//! The error of a store.

use glimpse_core::error::Error;

/// Result of a call of a store.
pub(super) type Result<T = ()> = core::result::Result<T, StoreError>;

/// An error of a store, which keeps its state from before the failed call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash could not be read, written or erased: check the layout's offset.
    Flash,
    /// The layout is too small or too large, or is not of whole sectors.
    Layout,
    /// The scan has too many samples.
    TooLarge,
    /// The current scan has no sample with this index.
    NoSample,
    /// The reading is invalid.
    Invalid(Error),
}
