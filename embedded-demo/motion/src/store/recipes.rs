//! Recipes that a host has sent: two slots, one of which is active.
//!
//! A new recipe is written to the inactive slot, in whole blocks. Then an item of the journal activates it.

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::error::Error;
use glimpse_core::recipe::Recipe;

use super::error::{Result, StoreError};
use super::journal::BLOCK_BYTES;
use super::{Item, Store};

impl<F: NorFlash, const SAMPLES: usize> Store<F, SAMPLES> {
    /// Stores a part of a new recipe. Parts must be consecutive. A part at offset 0 starts a transfer and erases a
    /// slot, which takes seconds on some chips. The active recipe does not change.
    ///
    /// # Errors
    /// If the slot is too small, the part does not follow the previous one, or the flash cannot be written. After an
    /// error of the flash, start again at offset 0.
    pub fn write_recipe(&mut self, offset: u32, bytes: &[u8]) -> Result {
        let end = (offset as usize).saturating_add(bytes.len());
        if end > self.layout.slot_bytes as usize {
            return Err(StoreError::TooLarge);
        }
        if offset != 0 && self.received != Some(offset) {
            return Err(StoreError::OutOfOrder);
        }
        self.received = None;
        if offset == 0 {
            let slot = self.inactive_slot();
            let erased = self.flash.erase(slot, slot + self.layout.slot_bytes);
            erased.map_err(|_| StoreError::Flash)?;
        }
        for (offset, byte) in (offset..).zip(bytes) {
            let at = offset as usize % BLOCK_BYTES;
            if let Some(to) = self.block.get_mut(at) {
                *to = *byte;
            }
            if at == BLOCK_BYTES - 1 {
                self.write_block(offset)?;
            }
        }
        self.received = Some(end as u32);
        Ok(())
    }

    /// Completes the transfer: activates the recipe, if it is valid and the firmware accepts it, and reads it into
    /// `buffer`, whole blocks of 32 bytes. After an error the old recipe stays active; the transfer may start again.
    ///
    /// # Errors
    /// If no transfer is under way, the bytes are not a recipe, `accepts` declines it, the buffer is too small, or the
    /// flash cannot be written.
    pub fn install<'b>(
        &mut self,
        buffer: &'b mut [u8],
        accepts: impl FnOnce(&Recipe<'_>) -> core::result::Result<(), Error>,
    ) -> Result<Recipe<'b>> {
        let length = self.received.take().ok_or(StoreError::OutOfOrder)?;
        if !(length as usize).is_multiple_of(BLOCK_BYTES) {
            self.write_block(length)?;
        }
        let slot = self.inactive_slot();
        let recipe = self.read_recipe(slot, length, buffer)?;
        accepts(&recipe).map_err(StoreError::Invalid)?;
        self.write(Item::Recipe((slot, length)))?;
        Ok(recipe)
    }

    /// Reads the active recipe into `buffer`, whole blocks of 32 bytes. None if no recipe was installed.
    ///
    /// # Errors
    /// If the buffer is too small, the recipe is damaged, or the flash cannot be read.
    pub fn recipe<'b>(&mut self, buffer: &'b mut [u8]) -> Result<Option<Recipe<'b>>> {
        match self.state.recipe {
            Some((slot, length)) => self.read_recipe(slot, length, buffer).map(Some),
            None => Ok(None),
        }
    }

    /// Writes the block of the new recipe with this offset.
    fn write_block(&mut self, offset: u32) -> Result {
        let start = offset - offset % BLOCK_BYTES as u32;
        let written = self.flash.write(self.inactive_slot() + start, &self.block);
        written.map_err(|_| StoreError::Flash)
    }

    fn read_recipe<'b>(
        &mut self,
        slot: u32,
        length: u32,
        buffer: &'b mut [u8],
    ) -> Result<Recipe<'b>> {
        let blocks = length.checked_next_multiple_of(BLOCK_BYTES as u32);
        let blocks = blocks.and_then(|bytes| buffer.get_mut(..bytes as usize));
        let blocks = blocks.ok_or(StoreError::TooLarge)?;
        let result = self.flash.read(slot, blocks);
        result.map_err(|_| StoreError::Flash)?;
        let bytes = blocks.get(..length as usize).unwrap_or_default();
        Recipe::parse(bytes).map_err(StoreError::Invalid)
    }

    /// Returns the offset of the inactive slot.
    fn inactive_slot(&self) -> u32 {
        let first = self.layout.start + 2 * self.layout.area_bytes;
        match self.state.recipe {
            Some((slot, _)) if slot == first => first + self.layout.slot_bytes,
            _ => first,
        }
    }
}
