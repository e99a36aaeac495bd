//! The chip's flash.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use stm32f4xx_hal::flash::{Error as FlashError, FlashExt, LockedFlash, UnlockedFlash};
use stm32f4xx_hal::pac;

/// Returns the sector of 128 KiB at this offset in the flash.
pub const fn sector(offset: u32) -> core::ops::Range<u32> {
    offset..offset + 128 * 1024
}

/// The chip's flash, unlocked only during an erase or a write. Both stall the core, and no arm moves meanwhile.
pub struct Flash(pub LockedFlash);

impl Flash {
    /// Flushes the data cache, whose content is stale after a change. The HAL enables the cache but does not flush it.
    fn flush_cache() {
        // SAFETY: it changes only these bits of a register that no other code writes after the clocks are configured.
        let flash = unsafe { &*pac::FLASH::ptr() };
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().set_bit());
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        ReadNorFlash::read(&mut self.0, offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = <UnlockedFlash<'_> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let erased = NorFlash::erase(&mut self.0.unlocked(), from, to);
        Self::flush_cache();
        erased
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let written = NorFlash::write(&mut self.0.unlocked(), offset, bytes);
        Self::flush_cache();
        written
    }
}
