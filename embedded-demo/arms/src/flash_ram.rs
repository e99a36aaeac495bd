//! A flash in RAM, for QEMU, which does not model the flash controller. It lies in memory that survives a reset.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a sector.
pub const SECTOR_BYTES: usize = 4096;

/// A flash in RAM: a write clears bits, and erasing a sector sets them.
#[derive(Debug)]
pub struct FlashRam<'b>(pub &'b mut [u8]);

/// Error: an address is out of bounds or misaligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfBounds;

impl NorFlashError for OutOfBounds {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl ErrorType for FlashRam<'_> {
    type Error = OutOfBounds;
}

impl FlashRam<'_> {
    fn range_mut(&mut self, from: u32, length: usize) -> Result<&mut [u8], OutOfBounds> {
        let from = from as usize;
        let to = from.saturating_add(length);
        self.0.get_mut(from..to).ok_or(OutOfBounds)
    }
}

impl ReadNorFlash for FlashRam<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), OutOfBounds> {
        let range = self.range_mut(offset, bytes.len())?;
        for (to, from) in bytes.iter_mut().zip(range) {
            *to = *from;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for FlashRam<'_> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), OutOfBounds> {
        let whole = |address: u32| (address as usize).is_multiple_of(SECTOR_BYTES);
        let length = to.checked_sub(from).ok_or(OutOfBounds)?;
        if !(whole(from) && whole(to)) {
            return Err(OutOfBounds);
        }
        self.range_mut(from, length as usize)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), OutOfBounds> {
        let range = self.range_mut(offset, bytes.len())?;
        for (to, from) in range.iter_mut().zip(bytes) {
            *to &= *from;
        }
        Ok(())
    }
}
