//! Recipes that were replaced in the field: two slots, of which one is in force.
//!
//! A new recipe goes into the other slot. Its header, with a sequence number, is written last: only
//! then is it in force. The recipe's own checksum says whether it is whole.
//!
//! A flash writes words of 1, 2, 4, 8, 16 or 32 bytes, and a part of a recipe need not end with a
//! word. Recipes are therefore written in blocks of 32 bytes: the last bytes of a part wait in RAM
//! until the next part completes the block, or until [`Recipes::install`] pads its last word.
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
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::ScanError;

use super::{MAX_WORD_BYTES, StoreError, word_bytes};

/// Where a slot's recipe begins: a multiple of the flash's word.
const HEADER_BYTES: usize = MAX_WORD_BYTES;

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
    /// Bytes of the new recipe that do not fill a block yet.
    tail: Tail,
}

/// Up to one block of bytes that are not in the flash yet.
#[derive(Clone, Copy, Debug, Default)]
struct Tail {
    bytes: [u8; MAX_WORD_BYTES],
    length: usize,
    /// The offset of the first byte in the recipe.
    offset: u32,
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
            buffer: (buffer.len() - buffer.len() % word_bytes::<F>()) as u32,
            declined: None,
            tail: Tail::default(),
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

    /// Stores a part of another recipe. Parts follow each other; at offset 0 the slot is erased. The
    /// recipe in force stays as it is.
    ///
    /// # Errors
    /// If there is no room for it, if it does not follow the part before, or if the flash does not
    /// take it.
    pub fn store<F: NorFlash>(
        &mut self,
        flash: &mut F,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let Range { start, end } = self.range(self.other());
        if offset == 0 {
            self.tail = Tail::default();
            flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        }
        if offset != self.tail.end() {
            return Err(StoreError::OutOfOrder);
        }
        for byte in bytes {
            if let Some(to) = self.tail.bytes.get_mut(self.tail.length) {
                *to = *byte;
            }
            self.tail.length = self.tail.length.saturating_add(1);
            if self.tail.length >= MAX_WORD_BYTES {
                self.flush(flash)?;
            }
        }
        Ok(())
    }

    /// Writes the tail as whole words.
    fn flush<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let Range { start, end } = self.range(self.other());
        let place = start
            .saturating_add(HEADER_BYTES as u32)
            .saturating_add(self.tail.offset);
        let words = self.tail.length.next_multiple_of(word_bytes::<F>());
        if place.saturating_add(words as u32) > end {
            return Err(StoreError::Full);
        }
        let bytes = self.tail.bytes.get(..self.tail.length);
        write(flash, place, bytes.unwrap_or_default())?;
        self.tail = Tail {
            offset: self.tail.end(),
            ..Tail::default()
        };
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
        if self.tail.length > 0 {
            self.flush(flash).map_err(ReplaceError::Store)?;
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

    #[inline(never)] // smaller: there are several calls
    fn read<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
        length: u32,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], StoreError> {
        // Whole words; what follows the recipe in the last one is of no interest.
        let words = (length as usize).next_multiple_of(word_bytes::<F>());
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

impl Tail {
    /// The offset of the byte after the last one.
    fn end(&self) -> u32 {
        self.offset.saturating_add(self.length as u32)
    }
}

/// Writes at most [`MAX_WORD_BYTES`] bytes as whole words; the rest of the last word stays erased.
fn write<F: NorFlash>(flash: &mut F, place: u32, bytes: &[u8]) -> Result<(), StoreError> {
    let mut words = [0xFF; MAX_WORD_BYTES];
    for (to, from) in words.iter_mut().zip(bytes) {
        *to = *from;
    }
    let words = words.get(..bytes.len().next_multiple_of(word_bytes::<F>()));
    let written = flash.write(place, words.unwrap_or_default());
    written.map_err(|_| StoreError::Flash)
}
