//! Recipes that were replaced in the field: two slots, of which one is in force.
//!
//! A new recipe goes into the other slot. Its header, with a sequence number, is written last: only
//! then is it in force. The recipe's own checksum says whether it is whole.
//!
//! | bytes of a slot | content |
//! |---|---|
//! | 0..4 | sequence number, little-endian; the larger one is in force |
//! | 4..8 | length of the recipe |
//! | 8..12 | both once more, inverted and mixed: sequence ^ !length |
//! | 32.. | the recipe |

use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::ScanError;

use super::StoreError;

/// Where a slot's recipe begins: a multiple of the flash's word.
const HEADER_BYTES: usize = 32;
/// Bytes that are written at a time: a multiple of the flash's word, and a divisor of what the link
/// sends at a time.
const WORD_BYTES: usize = 4;
const _: () = assert!(BYTES_PER_FRAME.is_multiple_of(WORD_BYTES));

/// Why a recipe was not replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReplaceError {
    /// What came is no recipe.
    Recipe(RecipeError),
    /// It is a whole recipe, but for another firmware.
    Scan(ScanError),
    /// It is a whole recipe, but another one than was offered.
    Other,
    /// The flash did not take it.
    Store(StoreError),
}

impl fmt::Display for ReplaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recipe(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Other => f.write_str("the host sent another recipe than it offered"),
            Self::Store(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ReplaceError {}

/// A slot's header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Header {
    sequence: u32,
    length: u32,
}

/// The two slots.
#[derive(Clone, Debug)]
pub struct Recipes {
    slots: [Range<u32>; 2],
    in_force: Option<(usize, Header)>,
    /// Bytes of the buffer that recipes are read into, in whole words.
    buffer: u32,
    /// The checksum of the recipe that was refused last.
    declined: Option<u32>,
}

impl Recipes {
    /// Looks which of two ranges of the flash, each of whole sectors, is in force; and reads its
    /// recipe into `buffer`, which is as long as those that follow. A recipe that it has no room for
    /// is as none: it may be of a firmware that had more.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn mount<F: NorFlash>(
        flash: &mut F,
        slots: [Range<u32>; 2],
        buffer: &mut [u8],
    ) -> Result<Self, StoreError> {
        let mut recipes = Self {
            slots,
            in_force: None,
            buffer: (buffer.len() - buffer.len() % WORD_BYTES) as u32,
            declined: None,
        };
        for slot in 0..recipes.slots.len() {
            let Some(header) = recipes.header(flash, slot)? else {
                continue;
            };
            let older = |(_, other): (usize, Header)| {
                header.sequence.wrapping_sub(other.sequence) > u32::MAX / 2
            };
            if recipes.in_force.is_some_and(older) {
                continue;
            }
            // One that is not whole is none.
            let bytes = recipes.read(flash, slot, header.length, buffer)?;
            if Recipe::parse(bytes).is_ok() {
                recipes.in_force = Some((slot, header));
            }
        }
        Ok(recipes)
    }

    /// Reads the recipe in force into `buffer`; None if none was ever put here.
    ///
    /// # Errors
    /// If the flash cannot be read, or the buffer has no room for it.
    pub fn load<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        buffer: &'b mut [u8],
    ) -> Result<Option<&'b [u8]>, StoreError> {
        match self.in_force {
            Some((slot, header)) => self.read(flash, slot, header.length, buffer).map(Some),
            None => Ok(None),
        }
    }

    /// The most bytes that a recipe may have: slots and buffer have room for them.
    pub fn room(&self) -> u32 {
        let room = |slot: &Range<u32>| slot.end.saturating_sub(slot.start);
        let least = self.slots.iter().map(room).min().unwrap_or(0);
        least.saturating_sub(HEADER_BYTES as u32).min(self.buffer)
    }

    /// The checksum of the recipe that was refused last. It is not fetched again before a reset: that
    /// would erase a slot each time, for nothing.
    pub fn declined(&self) -> Option<u32> {
        self.declined
    }

    /// The recipe that was offered with this checksum does not serve.
    pub fn decline(&mut self, checksum: u32) {
        self.declined = Some(checksum);
    }

    /// Stores a part of another recipe; `offset` is a multiple of 4, and at 0 what was stored of one
    /// before is erased. The recipe in force stays as it is.
    ///
    /// # Errors
    /// If there is no room for it, or the flash does not take it.
    pub fn store<F: NorFlash>(
        &self,
        flash: &mut F,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let Range { start, end } = self.range(self.other());
        if offset == 0 {
            flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        }
        let mut place = start
            .saturating_add(HEADER_BYTES as u32)
            .saturating_add(offset);
        for chunk in bytes.chunks(WORD_BYTES) {
            if place.saturating_add(WORD_BYTES as u32) > end {
                return Err(StoreError::Full);
            }
            write(flash, place, chunk)?;
            place = place.saturating_add(WORD_BYTES as u32);
        }
        Ok(())
    }

    /// Puts the recipe of `length` bytes that was stored in force, and reads it into `buffer`. If it
    /// is not whole, or the firmware does not accept it, the old one stays in force.
    ///
    /// # Errors
    /// If what was stored is no recipe, or `accepts` says that it does not serve; if the buffer has
    /// no room for it, or the flash does not take the header.
    pub fn install<'b, F: NorFlash>(
        &mut self,
        flash: &mut F,
        length: u32,
        buffer: &'b mut [u8],
        accepts: impl FnOnce(Recipe<'_>) -> Result<(), ReplaceError>,
    ) -> Result<&'b [u8], ReplaceError> {
        let slot = self.other();
        let sequence = self.in_force.map_or(0, |(_, header)| header.sequence);
        let header = Header {
            sequence: sequence.wrapping_add(1),
            length,
        };
        if length > self.room() {
            return Err(ReplaceError::Store(StoreError::Full));
        }
        let bytes = self.read(flash, slot, length, buffer);
        let bytes = bytes.map_err(ReplaceError::Store)?;
        accepts(Recipe::parse(bytes).map_err(ReplaceError::Recipe)?)?;
        let written = write(flash, self.range(slot).start, &header.to_bytes());
        written.map_err(ReplaceError::Store)?;
        self.in_force = Some((slot, header));
        Ok(bytes)
    }

    /// The slot that is not in force.
    fn other(&self) -> usize {
        match self.in_force {
            Some((0, _)) => 1,
            _ => 0,
        }
    }

    /// A slot's header, if it has one, of a recipe that there is room for.
    fn header<F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
    ) -> Result<Option<Header>, StoreError> {
        let mut bytes = [0; HEADER_BYTES];
        flash
            .read(self.range(slot).start, &mut bytes)
            .map_err(|_| StoreError::Flash)?;
        let header = Header::from_bytes(bytes);
        Ok(header.filter(|header| header.length <= self.room()))
    }

    fn read<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
        length: u32,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], StoreError> {
        // Whole words; what follows the recipe in the last one is of no interest.
        let words = (length as usize).next_multiple_of(WORD_BYTES);
        let start = self.range(slot).start.saturating_add(HEADER_BYTES as u32);
        let bytes = buffer.get_mut(..words).ok_or(StoreError::Full)?;
        flash.read(start, bytes).map_err(|_| StoreError::Flash)?;
        bytes.get(..length as usize).ok_or(StoreError::Full)
    }

    fn range(&self, slot: usize) -> Range<u32> {
        self.slots.get(slot).cloned().unwrap_or_default()
    }
}

impl Header {
    fn to_bytes(self) -> [u8; 12] {
        let [a, b, c, d] = self.sequence.to_le_bytes();
        let [e, f, g, h] = self.length.to_le_bytes();
        let [i, j, k, l] = self.check().to_le_bytes();
        [a, b, c, d, e, f, g, h, i, j, k, l]
    }

    fn from_bytes(bytes: [u8; HEADER_BYTES]) -> Option<Self> {
        let [a, b, c, d, e, f, g, h, i, j, k, l, ..] = bytes;
        let header = Self {
            sequence: u32::from_le_bytes([a, b, c, d]),
            length: u32::from_le_bytes([e, f, g, h]),
        };
        (header.check() == u32::from_le_bytes([i, j, k, l])).then_some(header)
    }

    fn check(self) -> u32 {
        self.sequence ^ !self.length
    }
}

/// Writes whole words; the rest of the last one stays erased.
fn write<F: NorFlash>(flash: &mut F, place: u32, bytes: &[u8]) -> Result<(), StoreError> {
    let mut words = [0xFF; 3 * WORD_BYTES];
    for (to, from) in words.iter_mut().zip(bytes) {
        *to = *from;
    }
    let words = words.get(..bytes.len().next_multiple_of(WORD_BYTES));
    let written = flash.write(place, words.unwrap_or_default());
    written.map_err(|_| StoreError::Flash)
}
