//! Readings of a scan that survive a reset, in a flash that C reads, erases and writes.

use core::ffi::c_int;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use glimpse_core::recipe::Recipe;
use glimpse_core::store::{Layout, Store};

use crate::handle::{glimpse_scan, scan as shared, scan_mut};
use crate::pointer::{Out, copy, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_flash, glimpse_reading};

/// Converts the result of a callback; None if it is null.
fn called(result: Option<c_int>) -> Result<(), NorFlashErrorKind> {
    let is_done = result == Some(0);
    is_done.then_some(()).ok_or(NorFlashErrorKind::Other)
}

impl ErrorType for glimpse_flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for glimpse_flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let (to, count) = (bytes.as_mut_ptr(), bytes.len());
        // SAFETY: the C caller keeps the contract of the header.
        called(
            self.read
                .map(|read| unsafe { read(self.context, offset, to, count) }),
        )
    }

    /// Only C knows the capacity: it returns an error beyond it.
    fn capacity(&self) -> usize {
        u32::MAX as usize
    }
}

impl NorFlash for glimpse_flash {
    const WRITE_SIZE: usize = 32;
    /// Only C knows the length of a sector. The store erases whole areas.
    const ERASE_SIZE: usize = 32;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        // SAFETY: the C caller keeps the contract of the header.
        called(
            self.erase
                .map(|erase| unsafe { erase(self.context, from, to) }),
        )
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let (from, count) = (bytes.as_ptr(), bytes.len());
        // SAFETY: the C caller keeps the contract of the header.
        called(
            self.write
                .map(|write| unsafe { write(self.context, offset, from, count) }),
        )
    }
}

/// Opens the store of a recipe.
///
/// # Safety
/// `flash` is null, misaligned, or points to a flash with valid callbacks.
pub(crate) unsafe fn mount(
    flash: *const glimpse_flash,
    recipe: &Recipe<'_>,
) -> Result<Store<glimpse_flash>, glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let flash = unsafe { copy(flash, glimpse_status::ArgumentFlash)? };
    let (start, area_bytes) = (flash.start, flash.area_bytes);
    let callbacks = flash.read.zip(flash.erase).zip(flash.write);
    callbacks.ok_or(glimpse_status::ArgumentFlash)?;
    Ok(Store::mount(flash, Layout { start, area_bytes }, recipe)?)
}

/// Counts a boot, for glimpse_config.sequence_seed. Call it once after each reset. The scan may have begun in
/// the memory in which glimpse_driver_begin() then begins a driver with the same recipe.
///
/// @param flash  The flash.
/// @param scan   The scan, or that of a driver.
/// @param boots  Receives the number of boots, including this one.
/// @return GLIMPSE_STATUS_STORAGE if a callback fails; GLIMPSE_STATUS_STORE_LAYOUT if the areas are too
///         small, or start or length is not a multiple of 32.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_store_count_boot(
    flash: *const glimpse_flash,
    scan: *const glimpse_scan,
    boots: *mut u32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (scan, out) = (shared(scan)?, Out::new(boots)?);
        out.put(mount(flash, scan.recipe())?.count_boot()?)
    })
}

/// Records the saved readings and skips in a scan. Call it after glimpse_scan_begin(); glimpse_driver_begin()
/// does it for a driver. An error while it reads leaves some of them in the scan.
///
/// @param flash  The flash.
/// @param scan   The scan.
/// @param count  Receives the number of readings, or null.
/// @return As glimpse_store_count_boot().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_store_restore(
    flash: *const glimpse_flash,
    scan: *mut glimpse_scan,
    count: *mut u16,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (scan, out) = (scan_mut(scan)?, Out::optional(count)?);
        out.put(mount(flash, scan.recipe())?.restore(scan)?)
    })
}

/// Saves a reading. It replaces an earlier one of the same sample.
///
/// @param flash    The flash.
/// @param scan     The scan, or that of a driver. Its own readings are not used.
/// @param index    Index of the sample in the pattern.
/// @param reading  The reading; null if the sample was skipped.
/// @return As glimpse_store_count_boot(), or GLIMPSE_STATUS_READING_... if the reading is invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_store_save(
    flash: *const glimpse_flash,
    scan: *const glimpse_scan,
    index: u16,
    reading: *const glimpse_reading,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let scan = shared(scan)?;
        let reading = match reading.is_null() {
            true => None,
            false => Some(copy(reading, glimpse_status::ArgumentReading)?.into()),
        };
        Ok(mount(flash, scan.recipe())?.save(index, reading, true)?)
    })
}

/// Deletes all saved readings.
///
/// @param flash  The flash.
/// @param scan   The scan, or that of a driver. Its own readings stay.
/// @return As glimpse_store_count_boot().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_store_clear(
    flash: *const glimpse_flash,
    scan: *const glimpse_scan,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { Ok(mount(flash, shared(scan)?.recipe())?.clear()?) })
}
