//! Recipes, and the readings of a scan.

use core::ffi::c_void;

use glimpse_core::geometry::Arms;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::handle::{CScan, Memory, bytes_for, exclusive, glimpse_scan, scan as shared, scan_mut};
use crate::pointer::{Out, copy, slice, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_reading, glimpse_recipe, glimpse_recorded, glimpse_sample};

/// Checks a recipe and describes it.
///
/// @param recipe  The recipe, as written by trainer, with any alignment, in flash or in RAM.
/// @param count   Number of bytes.
/// @param result  Receives the description.
/// @return GLIMPSE_STATUS_RECIPE_... if the bytes are not a valid recipe; GLIMPSE_STATUS_MODEL if the
///         library was built for another model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_recipe_describe(
    recipe: *const u8,
    count: usize,
    result: *mut glimpse_recipe,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let result = Out::new(result)?;
        let recipe = Recipe::parse(slice(recipe, count, glimpse_status::ArgumentRecipe)?)?;
        CScan::accept(&recipe, usize::MAX)?;
        result.put(glimpse_recipe {
            model: recipe.model() as i32,
            samples: recipe.samples() as u16,
            values: recipe.values() as u16,
            checksum: recipe.checksum(),
            expected_loss: recipe.expected_loss().unwrap_or(f32::NAN),
        })
    })
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
///                      GLIMPSE_MEMORY. No other code may read, write or move it until
///                      glimpse_scan_end().
/// @param memory_bytes  Its size: at least glimpse_scan_bytes() of the recipe.
/// @param recipe        The recipe, with any alignment. It is not copied: it must not change while the
///                      scan is in use. It must not lie in the scan's memory.
/// @param recipe_bytes  Number of bytes of the recipe.
/// @param scan          Receives the handle, a pointer into the memory; null after an error.
/// @return As glimpse_recipe_describe(), or GLIMPSE_STATUS_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    scan: *mut *mut glimpse_scan,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header. Recipe and memory stay valid while the handle is in use.
    status(|| unsafe {
        let out = Out::new(scan)?;
        out.put(core::ptr::null_mut())?;
        let memory = Memory::<CScan>::new(memory, memory_bytes)?;
        let recipe = Recipe::parse(slice(recipe, recipe_bytes, glimpse_status::ArgumentRecipe)?)?;
        CScan::accept(&recipe, memory.words)?;
        let scan = Scan::new(recipe, memory.numbers())?;
        out.put(memory.put(scan).cast())
    })
}

/// Ends a scan. Its memory can be used for anything else. Further calls with the handle return
/// GLIMPSE_STATUS_STALE, as long as the memory is not overwritten with the same bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_end(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { exclusive::<CScan>(scan.cast()).map(|handle| handle.tag = 0) })
}

/// Sets the basis that glimpse_fitted_brdf() needs for the model Linear. The whole basis is checked, which
/// takes some milliseconds per 100 kB on a Cortex-M4F at 168 MHz. A driver's scan cannot have a basis: a
/// host computes its BRDF from the values.
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
    // SAFETY: the C caller keeps the contract of the header. The basis stays valid while the handle is in use. The copy of
    // the scan replaces the original before either is used again; after an error it is dropped, which has no effect.
    status(|| unsafe {
        let scan: *mut CScan = scan_mut(scan)?;
        let basis = Basis::parse(slice(basis, count, glimpse_status::ArgumentBasis)?)?;
        scan.write(scan.read().with_basis(basis)?);
        Ok(())
    })
}

/// Deletes all readings for the next material. Skipped samples are pending again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_restart(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { scan_mut(scan).map(Scan::restart) })
}

/// Returns the next pending sample in the recipe's order. Samples may be read in any order:
/// glimpse_machine_nearest() returns the one that the arms reach first.
///
/// @param scan    The scan, or that of a driver.
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
    status(|| unsafe {
        let (scan, sample) = (shared(scan)?, Out::new(sample)?);
        let mut pending = scan.pending().skip_while(|(index, _)| *index < from);
        let (index, directions) = pending.next().ok_or(glimpse_status::NonePending)?;
        let mut pattern = scan.recipe().pattern();
        let angles = pattern.nth(usize::from(index)).unwrap_or_default();
        sample.put(glimpse_sample {
            index,
            directions: directions.into(),
            arms: Arms::from_directions(&directions).into(),
            theta_h: angles.theta_h,
            theta_d: angles.theta_d,
            phi_d: angles.phi_d,
        })
    })
}

/// Records the reading of a sample, in any order. A second reading of the same sample replaces the first:
/// glimpse_repeated_add() averages readings instead. A fit that is under way, or its result, is dropped.
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
    status(|| unsafe {
        let scan = scan_mut(scan)?;
        let reading = copy(reading, glimpse_status::ArgumentReading)?;
        let out = Out::optional(recorded)?;
        out.put(scan.record(index, reading.into())?.into())
    })
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
    status(|| unsafe { Ok(scan_mut(scan)?.skip(index)?) })
}

/// Skips all pending samples, so that the fit uses only the recorded readings.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_READING_REQUIRED if the recipe does not tolerate missing readings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_scan_finish_early(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { Ok(scan_mut(scan)?.finish_early()?) })
}

/// Returns the recorded reading of a sample, unchanged by fits.
///
/// @param scan     The scan, or that of a driver.
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
    status(|| unsafe {
        let (scan, out) = (shared(scan)?, Out::new(reading)?);
        let reading = scan.reading(index).ok_or(glimpse_status::NotRead)?;
        out.put(reading.into())
    })
}
