//! Readings: a scan from its beginning to its last reading.

use core::ffi::c_void;

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::configuration::CScan;
use crate::place::{Out, Place, exclusive, get, list, shared, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_reading, glimpse_recorded, glimpse_sample};

/// A scan of one material, in the caller's memory. It is used by one thread at a time.
pub struct glimpse_scan {
    _private: (),
}

/// How many bytes of memory glimpse_scan_begin() takes as the library was built;
/// GLIMPSE_SCAN_BYTES is no less if C's macros say the same.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_scan_bytes() -> usize {
    size_of::<Place<CScan>>()
}

/// Begins a scan. Whatever the memory held is overwritten, also if the scan cannot begin; it needs no
/// initialization.
///
/// @param memory        GLIMPSE_SCAN_BYTES of the caller's memory, aligned to GLIMPSE_ALIGNMENT, as
///                      GLIMPSE_MEMORY declares it. Until the caller has done with the scan nothing
///                      else may read or write it, nor may it be moved. There is nothing to free.
/// @param memory_bytes  How many bytes that are.
/// @param recipe        The recipe, of any alignment. It is not copied: it has to stay as it is for
///                      as long as the scan is used. It must not lie in the scan's memory.
/// @param recipe_bytes  How many bytes that are.
/// @param scan          The handle that the other functions take: a pointer into the memory. Null if
///                      the scan could not begin.
/// @return As glimpse_recipe_describe(), and GLIMPSE_STATUS_MEMORY_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    scan: *mut *mut glimpse_scan,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { begin(memory, memory_bytes, recipe, recipe_bytes, scan) })
}

unsafe fn begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    scan: *mut *mut glimpse_scan,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let out = unsafe { Out::new(scan)? };
    out.put(core::ptr::null_mut());
    // SAFETY: by the caller's word; recipe and memory live on for as long as the handle is used.
    let (recipe, (handle, memory)) = unsafe {
        (
            list(recipe, recipe_bytes)?,
            Place::<CScan>::prepare(memory, memory_bytes)?,
        )
    };
    let begun = Scan::new(Recipe::parse(recipe)?, memory)?;
    // SAFETY: `prepare` has checked the place; there is no reference to it yet.
    unsafe { handle.write(begun) };
    out.put(handle.cast::<glimpse_scan>());
    Ok(())
}

/// Forgets all readings, for the next material.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_restart(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.map(Scan::restart))
}

/// The next sample that was not read yet, in the recipe's order. They may be read in any order.
///
/// @param scan    The scan.
/// @param from    The least index that will do; 0 for the first sample that is left.
/// @param sample  Where to measure.
/// @return GLIMPSE_STATUS_NONE_PENDING if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_next(
    scan: *const glimpse_scan,
    from: u16,
    sample: *mut glimpse_sample,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { next(scan, from, sample) })
}

unsafe fn next(
    scan: *const glimpse_scan,
    from: u16,
    sample: *mut glimpse_sample,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>())?, Out::new(sample)?) };
    let mut pending = scan.pending().skip_while(|(index, _)| *index < from);
    let (index, directions) = pending.next().ok_or(glimpse_status::NonePending)?;
    let mut pattern = scan.recipe().pattern();
    let Angles {
        theta_h,
        theta_d,
        phi_d,
    } = pattern.nth(usize::from(index)).unwrap_or_default();
    out.put(glimpse_sample {
        index,
        directions: directions.into(),
        arms: directions.into(),
        theta_h,
        theta_d,
        phi_d,
    });
    Ok(())
}

/// Takes the reading of a sample, in any order. A second reading of the same sample replaces the
/// first; a fit that was under way, or its result, is given up.
///
/// @param scan      The scan.
/// @param index     Which sample of the pattern it is.
/// @param reading   What the sensor saw; it is copied.
/// @param recorded  What became of it, or null.
/// @return GLIMPSE_STATUS_READING_...: it cannot be a reading, and has to be taken again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_record(
    scan: *mut glimpse_scan,
    index: u16,
    reading: *const glimpse_reading,
    recorded: *mut glimpse_recorded,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { record(scan, index, reading, recorded) })
}

unsafe fn record(
    scan: *mut glimpse_scan,
    index: u16,
    reading: *const glimpse_reading,
    recorded: *mut glimpse_recorded,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, reading, out) = unsafe {
        (
            exclusive(scan.cast::<CScan>())?,
            get(reading)?,
            Out::optional(recorded)?,
        )
    };
    let recorded = scan.record(index, reading.into())?;
    if let Some(out) = out {
        out.put(glimpse_recorded {
            replaced: u8::from(recorded.replaced),
            clamped: u8::from(recorded.clamped),
        });
    }
    Ok(())
}

/// The reading of a sample. (A fit brings what is too far below 0 up to what the loss can take.)
///
/// @param scan     The scan.
/// @param index    Which sample of the pattern.
/// @param reading  What was recorded.
/// @return GLIMPSE_STATUS_NOT_READ if there is none, or no such sample.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_reading(
    scan: *const glimpse_scan,
    index: u16,
    reading: *mut glimpse_reading,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(reading)) };
    status(scan.and_then(|scan| {
        let reading = scan.reading(index).ok_or(glimpse_status::NotRead);
        let out = out?;
        out.put(reading?.into());
        Ok(())
    }))
}
