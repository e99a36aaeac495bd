//! What outlasts a power cut: the readings of the scan under way, and recipes that were replaced in
//! the field.
//!
//! Both are generic over [`NorFlash`](embedded_storage::nor_flash::NorFlash). Whenever the power
//! goes, what is found afterwards is the state before the interrupted call or the one after it;
//! `tests/suite/power_cuts.rs` cuts it in each write and each erase.

mod journal;
pub mod readings;
pub mod recipes;

use core::fmt;

/// What went wrong with the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// It could not be read, written or erased.
    Flash,
    /// There is no room for it.
    Full,
    /// It does not hold what was just written.
    Corrupted,
    /// No scan is under way that a reading could belong to.
    NoScan,
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flash => "the flash could not be read, written or erased",
            Self::Full => "the flash has no room for it: give it larger sectors",
            Self::Corrupted => {
                "the flash holds something else than was just written: it is worn out"
            }
            Self::NoScan => "no scan is under way: begin one first",
        })
    }
}

impl core::error::Error for StoreError {}
