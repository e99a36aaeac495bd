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
use glimpse_core::recipe::{Recipe, RecipeError};

use super::StoreError;

/// Where a slot's recipe begins: a multiple of every flash's word.
const HEADER_BYTES: usize = 32;
/// Bytes that are written or read at a time.
const CHUNK_BYTES: usize = 32;

/// Why a recipe was not replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReplaceError {
    /// What came is no recipe.
    Recipe(RecipeError),
    /// The flash did not take it.
    Store(StoreError),
}

impl fmt::Display for ReplaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recipe(error) => error.fmt(f),
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
}

impl Recipes {
    /// Two ranges of the flash, each of whole sectors.
    pub const fn new(slots: [Range<u32>; 2]) -> Self {
        Self { slots }
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
        let Some((slot, header)) = self.in_force(flash, buffer)? else {
            return Ok(None);
        };
        let bytes = self.read(flash, slot, header, buffer)?;
        Ok(Some(bytes))
    }

    /// Puts a recipe in force. Until it is whole the old one stays so.
    ///
    /// `buffer` is for looking at what is there, and has room for the larger of the two.
    ///
    /// # Errors
    /// If the bytes are no recipe, there is no room for it, or the flash does not take it.
    pub fn replace<F: NorFlash>(
        &self,
        flash: &mut F,
        recipe: &[u8],
        buffer: &mut [u8],
    ) -> Result<(), ReplaceError> {
        Recipe::parse(recipe).map_err(ReplaceError::Recipe)?;
        self.write(flash, recipe, buffer)
            .map_err(ReplaceError::Store)
    }

    fn write<F: NorFlash>(
        &self,
        flash: &mut F,
        recipe: &[u8],
        buffer: &mut [u8],
    ) -> Result<(), StoreError> {
        let (slot, sequence) = match self.in_force(flash, buffer)? {
            Some((0, header)) => (1, header.sequence.wrapping_add(1)),
            Some((_, header)) => (0, header.sequence.wrapping_add(1)),
            None => (0, 1),
        };
        let Range { start, end } = self.range(slot);
        let room = (end.saturating_sub(start) as usize).saturating_sub(HEADER_BYTES);
        if recipe.len().next_multiple_of(CHUNK_BYTES) > room {
            return Err(StoreError::Full);
        }
        flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        let places = (start..end).step_by(CHUNK_BYTES).skip(1);
        for (place, chunk) in places.zip(recipe.chunks(CHUNK_BYTES)) {
            write_chunk(flash, place, chunk)?;
        }
        let header = Header {
            sequence,
            length: recipe.len() as u32,
        };
        let written = self.read(flash, slot, header, buffer)?;
        if written != recipe {
            return Err(StoreError::Corrupted);
        }
        write_chunk(flash, start, &header.to_bytes())
    }

    /// The slot in force and its header. A slot whose recipe is not whole is none.
    fn in_force<F: NorFlash>(
        &self,
        flash: &mut F,
        buffer: &mut [u8],
    ) -> Result<Option<(usize, Header)>, StoreError> {
        let mut newest: Option<(usize, Header)> = None;
        for slot in 0..self.slots.len() {
            let Some(header) = self.header(flash, slot)? else {
                continue;
            };
            let older = newest.is_some_and(|(_, found)| {
                header.sequence.wrapping_sub(found.sequence) > u32::MAX / 2
            });
            if older {
                continue;
            }
            let bytes = self.read(flash, slot, header, buffer)?;
            if Recipe::parse(bytes).is_ok() {
                newest = Some((slot, header));
            }
        }
        Ok(newest)
    }

    /// A slot's header, if it has one, of a recipe that a slot has room for.
    fn header<F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
    ) -> Result<Option<Header>, StoreError> {
        let Range { start, end } = self.range(slot);
        let mut bytes = [0; HEADER_BYTES];
        flash
            .read(start, &mut bytes)
            .map_err(|_| StoreError::Flash)?;
        let room = (end.saturating_sub(start) as usize).saturating_sub(HEADER_BYTES);
        let header = Header::from_bytes(bytes);
        Ok(header.filter(|header| header.length as usize <= room))
    }

    fn read<'b, F: NorFlash>(
        &self,
        flash: &mut F,
        slot: usize,
        header: Header,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], StoreError> {
        let length = header.length as usize;
        // Whole words; what follows the recipe in the last one is of no interest.
        let words = length.next_multiple_of(CHUNK_BYTES);
        let start = self.range(slot).start.saturating_add(HEADER_BYTES as u32);
        let bytes = buffer.get_mut(..words).ok_or(StoreError::Full)?;
        flash.read(start, bytes).map_err(|_| StoreError::Flash)?;
        bytes.get(..length).ok_or(StoreError::Full)
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

/// Writes up to a chunk; the rest of it stays erased.
fn write_chunk<F: NorFlash>(flash: &mut F, place: u32, bytes: &[u8]) -> Result<(), StoreError> {
    let mut chunk = [0xFF; CHUNK_BYTES];
    for (to, from) in chunk.iter_mut().zip(bytes) {
        *to = *from;
    }
    flash.write(place, &chunk).map_err(|_| StoreError::Flash)
}
