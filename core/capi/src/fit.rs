//! A fit of a scan's readings, and the material that it finds.

use glimpse_core::fit::Progress;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::scan::Scan;

use crate::configuration::CScan;
use crate::place::{Out, exclusive, get, shared, status};
use crate::scan::glimpse_scan;
use crate::status::glimpse_status;
use crate::types::{glimpse_directions, glimpse_progress, glimpse_residual};

/// Begins a fit of all readings. One that was under way, or has ended, is forgotten.
///
/// Where the recipe can do without some of them, those that are missing or saturated are left out, as
/// long as there is one to go by: a fit may begin after the first reading, and again after each
/// further one.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_INCOMPLETE if a reading is missing that the recipe cannot do without,
///         GLIMPSE_STATUS_IMPLAUSIBLE if the readings are no BRDF's, as a sensor's raw counts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_begin(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.and_then(|scan| Ok(scan.fit().map(|_| ())?)))
}

/// Goes on with the fit. The result does not depend on the budgets.
///
/// @param scan      The scan.
/// @param budget    Units of work that are done at most: 8 are some milliseconds on a Cortex-M4F at
///                  168 MHz for the slowest model. UINT32_MAX does all of it.
/// @param progress  How far it is, or null.
/// @return GLIMPSE_STATUS_NO_FIT if none was begun.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_advance(
    scan: *mut glimpse_scan,
    budget: u32,
    progress: *mut glimpse_progress,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { advance(scan, budget, progress) })
}

unsafe fn advance(
    scan: *mut glimpse_scan,
    budget: u32,
    progress: *mut glimpse_progress,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, out) = unsafe { (exclusive(scan.cast::<CScan>())?, Out::optional(progress)?) };
    let mut fit = scan.fit_under_way().ok_or(glimpse_status::NoFit)?;
    let Progress { done, total } = fit.advance(budget);
    if let Some(out) = out {
        out.put(glimpse_progress { done, total });
    }
    Ok(())
}

/// Ends a complete fit: looks at every value, and at the fitted material at every reading.
///
/// @param scan      The scan.
/// @param residual  How well the fit explains the readings, or null.
/// @return GLIMPSE_STATUS_NO_FIT if none is under way, GLIMPSE_STATUS_UNFINISHED if it is not
///         complete, GLIMPSE_STATUS_DIVERGED if a number is not finite: then the readings are still
///         there, and no fit is under way any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_finish(
    scan: *mut glimpse_scan,
    residual: *mut glimpse_residual,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { finish(scan, residual) })
}

unsafe fn finish(
    scan: *mut glimpse_scan,
    residual: *mut glimpse_residual,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, out) = unsafe { (exclusive(scan.cast::<CScan>())?, Out::optional(residual)?) };
    let fit = scan.fit_under_way().ok_or(glimpse_status::NoFit)?;
    let fitted = fit.finish()?;
    if let Some(out) = out {
        out.put(fitted.residual().into());
    }
    Ok(())
}

/// How well the last fit explains its readings.
///
/// @param scan      The scan.
/// @param residual  The residual.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has ended since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_residual(
    scan: *const glimpse_scan,
    residual: *mut glimpse_residual,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(residual)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.residual().into());
        Ok(())
    }))
}

/// The loss that the last fit is likely to have, by its readings: an error bar for this material, where
/// the recipe predicts one, as those that complete readings do.
///
/// @param scan  The scan.
/// @param loss  The mean of ln(1 + f cos(theta_i)) that is likely to be missed; NAN if the recipe
///              predicts none, or more than a number can hold.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has ended since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_predicted_loss(
    scan: *const glimpse_scan,
    loss: *mut f32,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(loss)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.predicted_loss().unwrap_or(f32::NAN));
        Ok(())
    }))
}

/// The fitted material's BRDF.
///
/// @param scan        The scan.
/// @param directions  Where: two directions of unit length above the horizon.
/// @param brdf        Linear red, green and blue, in sr^-1, not times the cosine.
/// @return GLIMPSE_STATUS_NOT_FITTED, GLIMPSE_STATUS_DIRECTIONS, and for Linear
///         GLIMPSE_STATUS_NO_BASIS: see glimpse_scan_set_basis(), or have a host make it from the values;
///         or by its basis GLIMPSE_STATUS_DIVERGED: it is more than a number can hold.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_brdf(
    scan: *const glimpse_scan,
    directions: *const glimpse_directions,
    brdf: *mut [f32; 3],
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { self::brdf(scan, directions, brdf) })
}

unsafe fn brdf(
    scan: *const glimpse_scan,
    directions: *const glimpse_directions,
    brdf: *mut [f32; 3],
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, directions, out) = unsafe {
        (
            shared(scan.cast::<CScan>())?,
            get(directions)?,
            Out::new(brdf)?,
        )
    };
    let fitted = scan.fitted().ok_or(glimpse_status::NotFitted)?;
    let directions = directions.into();
    let Some(brdf) = fitted.brdf(&directions) else {
        let at = HalfDifference::from_directions(&directions);
        let is_above = at.is_some_and(|at| at.is_valid());
        return Err(match (is_above, scan.recipe().model()) {
            (false, _) => glimpse_status::Directions,
            (true, ModelKind::Linear) if scan.basis().is_none() => glimpse_status::NoBasis,
            // It is more than a number can hold.
            (true, _) => glimpse_status::Diverged,
        });
    };
    out.put(brdf);
    Ok(())
}

/// The fitted values, all finite: the model's parameters in its order, or Linear's coefficients, m
/// for red, m for green, m for blue. A host makes pictures of them.
///
/// @param scan      The scan.
/// @param values    Room for them; may be null if capacity is 0.
/// @param capacity  For how many.
/// @param count     How many there are; this is written if GLIMPSE_STATUS_BUFFER_TOO_SMALL is returned
///                  too.
/// @return GLIMPSE_STATUS_NOT_FITTED, GLIMPSE_STATUS_BUFFER_TOO_SMALL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_values(
    scan: *const glimpse_scan,
    values: *mut f32,
    capacity: usize,
    count: *mut usize,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { self::values(scan, values, capacity, count) })
}

unsafe fn values(
    scan: *const glimpse_scan,
    values: *mut f32,
    capacity: usize,
    count: *mut usize,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (scan, count) = unsafe { (shared(scan.cast::<CScan>())?, Out::new(count)?) };
    let fitted = Scan::fitted(scan).ok_or(glimpse_status::NotFitted)?;
    let total = fitted.values().count();
    if total > capacity {
        count.put(total);
        return Err(glimpse_status::BufferTooSmall);
    }
    // SAFETY: only looked at.
    let first = unsafe { Out::new(values)? };
    for (index, value) in fitted.values().enumerate() {
        // SAFETY: there is room for `capacity` of them, by the caller's word, and `total` is no more.
        unsafe { first.put_at(index, value) };
    }
    count.put(total);
    Ok(())
}
