//! Storage that survives a power cut: the readings of the current scan, and recipes that a host has sent.
//!
//! Both are generic over [`NorFlash`](embedded_storage::nor_flash::NorFlash). After a power cut at any time, the flash
//! has the state before the interrupted call or the state after it. `tests/suite/power_cuts.rs` cuts the power in each
//! write and each erase.

mod journal;
pub mod readings;
pub mod recipes;

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

/// Maximum word of a flash, bytes.
const MAX_WORD_BYTES: usize = 32;

/// Returns the word of a flash in bytes. A flash reads and writes whole words only.
const fn word_bytes<F: NorFlash>() -> usize {
    const {
        let word = if F::WRITE_SIZE > F::READ_SIZE {
            F::WRITE_SIZE
        } else {
            F::READ_SIZE
        };
        assert!(
            word.is_power_of_two() && word <= MAX_WORD_BYTES,
            "the word of a flash must be 1, 2, 4, 8, 16 or 32 bytes"
        );
        word
    }
}

/// An error of the storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// The flash could not be read, written or erased.
    Flash,
    /// The flash or a buffer is too small.
    Full,
    /// A part of a recipe does not follow the previous part.
    OutOfOrder,
    /// No scan is under way, or the scan has no sample with this index.
    NoScan,
}

impl fmt::Display for StoreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flash => {
                "the flash could not be read, written or erased: check the addresses of its sectors"
            }
            Self::Full => {
                "the flash or the buffer is too small: increase the sectors or the buffer"
            }
            Self::OutOfOrder => {
                "a part of the recipe is missing: send the recipe again from its start"
            }
            Self::NoScan => "no scan is under way: begin one first",
        })
    }
}

impl core::error::Error for StoreError {}
