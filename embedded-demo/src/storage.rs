//! Memory that survives a reset, as a flash for core's store.
//!
//! After a reset (by the watchdog, the button, or a dip of the supply) an interrupted scan continues with its saved
//! readings. RAM loses its content when power is off for longer than a moment; the store's checksums detect that.

use core::sync::atomic::{AtomicU8, Ordering};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use glimpse_core::store::Layout;

/// Bytes of an area: enough for the 64 samples of the largest recipe.
const AREA_BYTES: usize = 2304;
/// Bytes that `memory/` reserves.
const MEMORY_BYTES: usize = 2 * AREA_BYTES;
/// The place of the store.
pub const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: AREA_BYTES as u32,
};

// SAFETY: the linker script reserves these bytes for this static alone, and any bytes are valid `AtomicU8`s.
unsafe extern "C" {
    /// Memory that start-up code does not initialize. Atomic, because a mutable static must be.
    #[link_name = "_retained"]
    safe static MEMORY: [AtomicU8; MEMORY_BYTES];
}

/// The memory, in words of a byte.
pub struct Retained;

/// Returns the bytes of a range.
fn bytes(offset: u32, count: usize) -> Result<&'static [AtomicU8], NorFlashErrorKind> {
    let rest = MEMORY.get(offset as usize..);
    let bytes = rest.and_then(|rest| rest.get(..count));
    bytes.ok_or(NorFlashErrorKind::OutOfBounds)
}

impl ErrorType for Retained {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Retained {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, to: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let stored = bytes(offset, to.len())?;
        for (to, byte) in to.iter_mut().zip(stored) {
            *to = byte.load(Ordering::Relaxed);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        MEMORY_BYTES
    }
}

impl NorFlash for Retained {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 32;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let erased = bytes(from, to.saturating_sub(from) as usize)?;
        erased
            .iter()
            .for_each(|byte| byte.store(0xFF, Ordering::Relaxed));
        Ok(())
    }

    fn write(&mut self, offset: u32, from: &[u8]) -> Result<(), NorFlashErrorKind> {
        for (byte, from) in bytes(offset, from.len())?.iter().zip(from) {
            byte.store(*from, Ordering::Relaxed);
        }
        Ok(())
    }
}
