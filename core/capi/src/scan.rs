//! The readings of a scan.

use core::ffi::c_void;

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Scan, ScanError};

use crate::configuration::CScan;
use crate::pointer::{CallerMemory, Out, bytes_for, copy_of, exclusive, shared, slice, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_reading, glimpse_recorded, glimpse_sample};

/// A scan of one material, in the caller's memory. Use it from one thread at a time.
pub struct glimpse_scan {
    _private: (),
}

/// Returns the size of the memory that glimpse_scan_begin() needs with a recipe, in bytes. Returns 0 if this
/// library does not accept the recipe: glimpse_recipe_describe() returns the reason.
///
/// @param recipe  The recipe, with any alignment.
/// @param count   Number of bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_bytes(recipe: *const u8, count: usize) -> usize {
    // SAFETY: the C caller keeps the contract of the header.
    unsafe { bytes_for::<CScan>(recipe, count) }
}

/// Begins a scan. The memory needs no initialization; its content is overwritten.
///
/// @param memory        The caller's memory, aligned to GLIMPSE_ALIGNMENT, as declared by
///                      GLIMPSE_MEMORY. No other code may read, write or move it while the scan is in
///                      use. Nothing must be freed.
/// @param memory_bytes  Its size: at least glimpse_scan_bytes() of the recipe.
/// @param recipe        The recipe, with any alignment. It is not copied: it must not change while the
///                      scan is in use. It must not lie in the scan's memory.
/// @param recipe_bytes  Number of bytes of the recipe.
/// @param scan          Receives the handle, a pointer into the memory; null after an error.
/// @return As glimpse_recipe_describe(), or GLIMPSE_STATUS_MEMORY_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    scan: *mut *mut glimpse_scan,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { begin(memory, memory_bytes, recipe, recipe_bytes, scan) })
}

unsafe fn begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    scan: *mut *mut glimpse_scan,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let out = unsafe { Out::new(scan)? };
    out.put(core::ptr::null_mut());
    // SAFETY: guaranteed by the caller; recipe and memory stay valid while the handle is in use.
    let (recipe, memory) = unsafe {
        (
            slice(recipe, recipe_bytes)?,
            CallerMemory::<CScan>::new(memory, memory_bytes)?,
        )
    };
    let recipe = Recipe::parse(recipe)?;
    let words = CScan::accept(&recipe, memory.words()).map_err(|error| match error {
        ScanError::Memory { .. } => glimpse_status::MemoryTooSmall,
        error => error.into(),
    })?;
    let handle = memory.put(words, |numbers| Scan::new(recipe, numbers))?;
    out.put(handle.cast::<glimpse_scan>());
    Ok(())
}

/// Sets the basis that glimpse_fitted_brdf() needs for the model Linear. The whole basis is checked, which
/// takes some milliseconds per 100 kB on a Cortex-M4F at 168 MHz.
///
/// @param scan   The scan.
/// @param basis  The output of trainer export --format basis, with any alignment. It is not copied: it
///               must not change while the scan is in use.
/// @param count  Number of bytes.
/// @return GLIMPSE_STATUS_BASIS_... if the bytes are not a valid basis; GLIMPSE_STATUS_BASIS if the
///         recipe names another basis.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_set_basis(
    scan: *mut glimpse_scan,
    basis: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { set_basis(scan.cast::<CScan>(), basis, count) })
}

unsafe fn set_basis(
    scan: *mut CScan,
    basis: *const u8,
    count: usize,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller; the basis stays valid while the handle is in use.
    let basis = unsafe {
        exclusive(scan)?;
        Basis::parse(slice(basis, count)?)?
    };
    // SAFETY: the pointer was checked. The copy replaces the original before either is used again. After an error the
    // copy is dropped, which has no effect.
    unsafe { scan.write(scan.read().with_basis(basis)?) };
    Ok(())
}

/// Deletes all readings for the next material. Skipped samples are pending again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_restart(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.map(Scan::restart))
}

/// Returns the next pending sample in the recipe's order. Samples may be read in any order.
///
/// @param scan    The scan.
/// @param from    The smallest index to return; 0 for the first pending sample.
/// @param sample  Receives the sample.
/// @return GLIMPSE_STATUS_NONE_PENDING if all samples from this index on are read or skipped.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_next(
    scan: *const glimpse_scan,
    from: u16,
    sample: *mut glimpse_sample,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { next(scan, from, sample) })
}

unsafe fn next(
    scan: *const glimpse_scan,
    from: u16,
    sample: *mut glimpse_sample,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
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

/// Records the reading of a sample, in any order. A second reading of the same sample replaces the
/// first. A fit that is under way, or its result, is dropped.
///
/// @param scan      The scan.
/// @param index     Index of the sample in the pattern.
/// @param reading   The reading; it is copied.
/// @param recorded  Receives details, or null.
/// @return GLIMPSE_STATUS_READING_... if the reading is invalid: read the sample again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_record(
    scan: *mut glimpse_scan,
    index: u16,
    reading: *const glimpse_reading,
    recorded: *mut glimpse_recorded,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { record(scan, index, reading, recorded) })
}

unsafe fn record(
    scan: *mut glimpse_scan,
    index: u16,
    reading: *const glimpse_reading,
    recorded: *mut glimpse_recorded,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (scan, reading, out) = unsafe {
        (
            exclusive(scan.cast::<CScan>())?,
            copy_of(reading)?,
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

/// Skips a sample that cannot be read: it is no longer pending, and its reading is deleted. A later
/// glimpse_scan_record() of the sample undoes this. A fit that is under way, or its result, is dropped.
///
/// @param scan   The scan.
/// @param index  Index of the sample in the pattern.
/// @return GLIMPSE_STATUS_READING_REQUIRED if the recipe does not tolerate missing readings,
///         GLIMPSE_STATUS_READING_INDEX if the index is too large.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_skip(scan: *mut glimpse_scan, index: u16) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.and_then(|scan| Ok(scan.skip(index)?)))
}

/// Skips all pending samples, so that the fit uses the readings taken so far.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_READING_REQUIRED if the recipe does not tolerate missing readings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_finish_early(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.and_then(|scan| Ok(scan.finish_early()?)))
}

/// Returns the reading of a sample. A fit raises readings that are too far below 0.
///
/// @param scan     The scan.
/// @param index    Index of the sample in the pattern.
/// @param reading  Receives the reading.
/// @return GLIMPSE_STATUS_NOT_READ if the sample has no reading, or does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_reading(
    scan: *const glimpse_scan,
    index: u16,
    reading: *mut glimpse_reading,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(reading)) };
    status(scan.and_then(|scan| {
        let reading = scan.reading(index).ok_or(glimpse_status::NotRead);
        let out = out?;
        out.put(reading?.into());
        Ok(())
    }))
}
