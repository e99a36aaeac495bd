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

use embedded_storage::nor_flash::NorFlash;

/// The largest word of a flash, bytes.
const MAX_WORD_BYTES: usize = 32;

/// The word of a flash in bytes: it reads and writes whole words only.
const fn word_bytes<F: NorFlash>() -> usize {
    const {
        let word = if F::WRITE_SIZE > F::READ_SIZE {
            F::WRITE_SIZE
        } else {
            F::READ_SIZE
        };
        assert!(
            word.is_power_of_two() && word <= MAX_WORD_BYTES,
            "a flash has words of 1, 2, 4, 8, 16 or 32 bytes"
        );
        word
    }
}

/// What went wrong with the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// It could not be read, written or erased.
    Flash,
    /// There is no room for it.
    Full,
    /// A part of a recipe does not follow the part before.
    OutOfOrder,
    /// No scan is under way that a reading could belong to.
    NoScan,
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flash => "the flash could not be read, written or erased",
            Self::Full => "the flash has no room for it: give it larger sectors",
            Self::OutOfOrder => {
                "a part of the recipe is missing: send the recipe again from its start"
            }
            Self::NoScan => "no scan is under way: begin one first",
        })
    }
}

impl core::error::Error for StoreError {}
