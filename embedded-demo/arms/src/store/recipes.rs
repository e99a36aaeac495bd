//! Recipes that a host has sent: two slots, one of which is active.
//!
//! A new recipe is written to the inactive slot. Its header, with a sequence number, is written last and activates it.
//! The recipe's own checksum shows that it is complete.
//!
//! A flash writes words of 1, 2, 4, 8, 16 or 32 bytes, and a part of a recipe may end within a word. Recipes are
//! therefore written in blocks of 32 bytes. The last bytes of a part stay in RAM until the next part completes the
//! block, or until [`Recipes::install`] pads its last word.
//!
//! | bytes of a slot | content |
//! |---|---|
//! | 0..4 | sequence number, little-endian; the slot with the larger one is active |
//! | 4..8 | length of the recipe |
//! | 8..12 | check word: sequence ^ !length |
//! | 32.. | the recipe |

use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_core::scan::ScanError;

use super::{MAX_WORD_BYTES, StoreError, word_bytes};

/// Offset of the recipe in a slot: a multiple of the flash's word.
const HEADER_BYTES: usize = MAX_WORD_BYTES;

/// The reason why a recipe was not installed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReplaceError {
    /// The received bytes are not a valid recipe.
    Recipe(RecipeError),
    /// The recipe is valid, but this firmware cannot use it.
    Scan(ScanError),
    /// The recipe is valid, but not the one that the host offered.
    Mismatch,
    /// The recipe could not be stored.
    Store(StoreError),
}

impl fmt::Display for ReplaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recipe(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Mismatch => f.write_str(
                "the sent recipe differs from the one that the host offered: check the host",
            ),
            Self::Store(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ReplaceError {}

/// Header of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Header {
    sequence: u32,
    length: u32,
}

/// Storage of recipes in two slots.
#[derive(Clone, Debug)]
pub struct Recipes {
    slots: [Range<u32>; 2],
    active: Option<(usize, Header)>,
    /// Capacity of the read buffer in bytes, rounded down to whole words.
    buffer: u32,
    /// Checksum of the last rejected recipe.
    declined: Option<u32>,
    /// Bytes of the new recipe that do not fill a block yet.
    pending: PendingBlock,
}

/// Up to one block of bytes that are not in the flash yet.
#[derive(Clone, Copy, Debug, Default)]
struct PendingBlock {
    bytes: [u8; MAX_WORD_BYTES],
    length: usize,
    /// Offset of the first byte in the recipe.
    offset: u32,
}

impl Recipes {
    /// Opens two ranges of the flash, each of whole sectors, and finds the active recipe. Reads it into `buffer`, which
    /// must be as long as the buffers of later calls. A recipe that does not fit into the buffer is ignored: it may
    /// come from a firmware with a larger one.
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
            active: None,
            buffer: (buffer.len() - buffer.len() % word_bytes::<F>()) as u32,
            declined: None,
            pending: PendingBlock::default(),
        };
        for slot in 0..recipes.slots.len() {
            let Some(header) = recipes.header(flash, slot)? else {
                continue;
            };
            let is_older = |(_, other): (usize, Header)| {
                header.sequence.wrapping_sub(other.sequence) > u32::MAX / 2
            };
            if recipes.active.is_some_and(is_older) {
                continue;
            }
            // An incomplete recipe is ignored.
            let bytes = recipes.read(flash, slot, header.length, buffer)?;
            if Recipe::parse(bytes).is_ok() {
                recipes.active = Some((slot, header));
            }
        }
        Ok(recipes)
    }

    /// Reads the active recipe into `buffer`. None if no recipe was installed.
    ///
    /// # Errors
    /// If the flash cannot be read, or the buffer is too small.
    pub fn load<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        buffer: &'b mut [u8],
    ) -> Result<Option<&'b [u8]>, StoreError> {
        match self.active {
            Some((slot, header)) => self.read(flash, slot, header.length, buffer).map(Some),
            None => Ok(None),
        }
    }

    /// Returns the maximum bytes of a recipe: slots and buffer have room for them.
    pub fn capacity(&self) -> u32 {
        let slot_bytes = |slot: &Range<u32>| slot.end.saturating_sub(slot.start);
        let min_bytes = self.slots.iter().map(slot_bytes).min().unwrap_or(0);
        min_bytes
            .saturating_sub(HEADER_BYTES as u32)
            .min(self.buffer)
    }

    /// Returns the checksum of the last rejected recipe. It is not fetched again before a reset, because each attempt
    /// would erase a slot.
    pub fn declined(&self) -> Option<u32> {
        self.declined
    }

    /// Marks the recipe with this checksum as rejected.
    pub fn decline(&mut self, checksum: u32) {
        self.declined = Some(checksum);
    }

    /// Stores a part of a new recipe. Parts must be consecutive; a part at offset 0 erases the slot. The active recipe
    /// does not change.
    ///
    /// # Errors
    /// If the slot is too small, the part does not follow the previous one, or the flash cannot be written.
    pub fn store<F: NorFlash>(
        &mut self,
        flash: &mut F,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let Range { start, end } = self.range(self.inactive_slot());
        if offset == 0 {
            self.pending = PendingBlock::default();
            flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        }
        if offset != self.pending.end() {
            return Err(StoreError::OutOfOrder);
        }
        for byte in bytes {
            if let Some(to) = self.pending.bytes.get_mut(self.pending.length) {
                *to = *byte;
            }
            self.pending.length = self.pending.length.saturating_add(1);
            if self.pending.length >= MAX_WORD_BYTES {
                self.flush(flash)?;
            }
        }
        Ok(())
    }

    /// Writes the pending block as whole words.
    fn flush<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let Range { start, end } = self.range(self.inactive_slot());
        let address = start
            .saturating_add(HEADER_BYTES as u32)
            .saturating_add(self.pending.offset);
        let words = self.pending.length.next_multiple_of(word_bytes::<F>());
        if address.saturating_add(words as u32) > end {
            return Err(StoreError::Full);
        }
        let bytes = self.pending.bytes.get(..self.pending.length);
        write(flash, address, bytes.unwrap_or_default())?;
        self.pending = PendingBlock {
            offset: self.pending.end(),
            ..PendingBlock::default()
        };
        Ok(())
    }

    /// Activates the stored recipe of `length` bytes, and reads it into `buffer`. If the recipe is incomplete or not
    /// accepted, the old one stays active.
    ///
    /// # Errors
    /// If the stored bytes are not a recipe, `accepts` rejects it, the buffer is too small, or the flash cannot be
    /// written.
    pub fn install<'b, F: NorFlash>(
        &mut self,
        flash: &mut F,
        length: u32,
        buffer: &'b mut [u8],
        accepts: impl FnOnce(Recipe<'_>) -> Result<(), ReplaceError>,
    ) -> Result<&'b [u8], ReplaceError> {
        let slot = self.inactive_slot();
        let sequence = self.active.map_or(0, |(_, header)| header.sequence);
        let header = Header {
            sequence: sequence.wrapping_add(1),
            length,
        };
        if length > self.capacity() {
            return Err(ReplaceError::Store(StoreError::Full));
        }
        if self.pending.length > 0 {
            self.flush(flash).map_err(ReplaceError::Store)?;
        }
        let bytes = self.read(flash, slot, length, buffer);
        let bytes = bytes.map_err(ReplaceError::Store)?;
        accepts(Recipe::parse(bytes).map_err(ReplaceError::Recipe)?)?;
        let written = write(flash, self.range(slot).start, &header.to_bytes());
        written.map_err(ReplaceError::Store)?;
        self.active = Some((slot, header));
        Ok(bytes)
    }

    /// Returns the index of the inactive slot.
    fn inactive_slot(&self) -> usize {
        match self.active {
            Some((0, _)) => 1,
            _ => 0,
        }
    }

    /// Returns the header of a slot, if it is valid and its recipe fits.
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
        Ok(header.filter(|header| header.length <= self.capacity()))
    }

    #[inline(never)] // saves flash: one copy for several calls
    fn read<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
        length: u32,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], StoreError> {
        // Reads whole words. The bytes after the recipe in the last word are ignored.
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

impl PendingBlock {
    /// Returns the offset of the next byte.
    fn end(&self) -> u32 {
        self.offset.saturating_add(self.length as u32)
    }
}

/// Writes at most [`MAX_WORD_BYTES`] bytes as whole words. The rest of the last word stays erased.
fn write<F: NorFlash>(flash: &mut F, address: u32, bytes: &[u8]) -> Result<(), StoreError> {
    let mut words = [0xFF; MAX_WORD_BYTES];
    for (to, from) in words.iter_mut().zip(bytes) {
        *to = *from;
    }
    let words = words.get(..bytes.len().next_multiple_of(word_bytes::<F>()));
    let written = flash.write(address, words.unwrap_or_default());
    written.map_err(|_| StoreError::Flash)
}
