//! The fit of a scan's readings, and the fitted material.

use glimpse_core::error::ErrorCode;
use glimpse_core::geometry::Directions;
use glimpse_core::model::ModelKind;

use crate::handle::{glimpse_scan, scan as shared, scan_mut};
use crate::pointer::{Out, check, copy, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_directions, glimpse_fitted, glimpse_progress};

/// Begins a fit of all readings. An earlier fit is dropped.
///
/// If the recipe tolerates missing readings, the fit omits missing and saturated readings. If all readings
/// are saturated, it uses them. A fit may therefore begin after the first reading, and again after each
/// further one.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_INCOMPLETE if a required reading or every reading is missing;
///         GLIMPSE_STATUS_READINGS_TOO_LARGE if the readings are too large for a BRDF, such as counts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_begin(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { Ok(scan_mut(scan)?.fit().map(|_| ())?) })
}

/// Advances the fit. The result does not depend on the budgets.
///
/// @param scan      The scan.
/// @param budget    The maximum number of units of work. 8 units take some milliseconds on a Cortex-M4F at
///                  168 MHz with the slowest model. UINT32_MAX completes the fit.
/// @param progress  Receives the progress, or null.
/// @return GLIMPSE_STATUS_NO_FIT if no fit is under way.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_advance(
    scan: *mut glimpse_scan,
    budget: u32,
    progress: *mut glimpse_progress,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (scan, out) = (scan_mut(scan)?, Out::optional(progress)?);
        let mut fit = scan.fit_under_way().ok_or(glimpse_status::NoFit)?;
        out.put(fit.advance(budget).into())
    })
}

/// Finishes a complete fit. Checks that all values, and the fitted material at every reading, are finite and
/// plausible.
///
/// After GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED (84 to 95) the fit has a result, but it
/// is unlikely to describe a material: check the sensor. The glimpse_fitted_...() functions return the result
/// nevertheless.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_NO_FIT if no fit is under way; GLIMPSE_STATUS_UNFINISHED if it is not
///         complete; GLIMPSE_STATUS_DIVERGED if a number is not finite: the readings stay, and the fit
///         ends; GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED if the result is
///         implausible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_finish(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let fit = scan_mut(scan)?.fit_under_way();
        Ok(fit.ok_or(glimpse_status::NoFit)?.finish().map(|_| ())?)
    })
}

/// Describes the fitted material: its residual, and the expected error of its BRDF.
///
/// @param scan    The scan, or that of a driver.
/// @param fitted  Receives the description.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_describe(
    scan: *const glimpse_scan,
    fitted: *mut glimpse_fitted,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (scan, out) = (shared(scan)?, Out::new(fitted)?);
        out.put(scan.fitted().ok_or(glimpse_status::NotFitted)?.into())
    })
}

/// Returns the fitted material's BRDF.
///
/// @param scan        The scan, or that of a driver.
/// @param directions  Two unit directions above the horizon.
/// @param brdf        Receives linear red, green and blue, in sr^-1, not times the cosine.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading;
///         GLIMPSE_STATUS_DIRECTIONS if a direction is invalid; GLIMPSE_STATUS_NO_BASIS if the model is
///         Linear and the scan has no basis: call glimpse_scan_set_basis(), or compute the BRDF on a host
///         from the values; GLIMPSE_STATUS_DIVERGED if the BRDF is too large for a float.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_brdf(
    scan: *const glimpse_scan,
    directions: *const glimpse_directions,
    brdf: *mut [f32; 3],
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let scan = shared(scan)?;
        let directions = copy(directions, glimpse_status::ArgumentDirections)?.into();
        let out = Out::new(brdf)?;
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted)?;
        let Some(brdf) = fitted.brdf(&directions) else {
            return Err(match (is_above(&directions), scan.recipe().model()) {
                (false, _) => ErrorCode::Directions.into(),
                (true, ModelKind::Linear) if scan.basis().is_none() => glimpse_status::NoBasis,
                // The value is too large for a float.
                (true, _) => ErrorCode::Diverged.into(),
            });
        };
        out.put(brdf)
    })
}

/// Returns true if both directions are above the horizon by more than rounding errors.
fn is_above(directions: &Directions<f32>) -> bool {
    const GRAZING: f32 = 1e-5; // cosine
    let both = [directions.incoming, directions.outgoing];
    directions.check().is_ok() && both.iter().all(|[.., cosine]| *cosine > GRAZING)
}

/// Returns the fitted values, all finite: the model's parameters in its order, or Linear's coefficients,
/// m for red, m for green, m for blue. A host renders them.
///
/// @param scan      The scan, or that of a driver.
/// @param values    Receives the values; may be null if capacity is 0.
/// @param capacity  The largest number of values to write.
/// @param count     Receives the number of values, also with GLIMPSE_STATUS_BUFFER_TOO_SMALL.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading;
///         GLIMPSE_STATUS_BUFFER_TOO_SMALL if capacity is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_values(
    scan: *const glimpse_scan,
    values: *mut f32,
    capacity: usize,
    count: *mut usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (scan, count) = (shared(scan)?, Out::new(count)?);
        if capacity > 0 {
            check(values, glimpse_status::ArgumentValues)?;
        }
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted)?;
        let total = fitted.values().count();
        count.put(total)?;
        if total > capacity {
            return Err(ErrorCode::BufferTooSmall.into());
        }
        for (index, value) in fitted.values().enumerate() {
            values.add(index).write(value);
        }
        Ok(())
    })
}
