//! The fit of a scan's readings, and the fitted material.

use glimpse_core::fit::Progress;
use glimpse_core::geometry::Directions;
use glimpse_core::model::ModelKind;
use glimpse_core::scan::Scan;

use crate::configuration::CScan;
use crate::pointer::{Out, copy_of, exclusive, shared, status};
use crate::scan::glimpse_scan;
use crate::status::glimpse_status;
use crate::types::{glimpse_answer, glimpse_directions, glimpse_progress, glimpse_residual};

/// Begins a fit of all readings. An earlier fit is dropped.
///
/// If the recipe tolerates missing readings, the fit omits missing and saturated readings. If all readings
/// are saturated, it uses them. A fit may therefore begin after the first reading, and again after each
/// further one.
///
/// @param scan  The scan.
/// @return GLIMPSE_STATUS_INCOMPLETE if a required reading or every reading is missing;
///         GLIMPSE_STATUS_TOO_LARGE if the readings are too large for a BRDF, such as counts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_begin(scan: *mut glimpse_scan) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let scan = unsafe { exclusive(scan.cast::<CScan>()) };
    status(scan.and_then(|scan| Ok(scan.fit().map(|_| ())?)))
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
    status(unsafe { advance(scan, budget, progress) })
}

unsafe fn advance(
    scan: *mut glimpse_scan,
    budget: u32,
    progress: *mut glimpse_progress,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (scan, out) = unsafe { (exclusive(scan.cast::<CScan>())?, Out::optional(progress)?) };
    let mut fit = scan.fit_under_way().ok_or(glimpse_status::NoFit)?;
    let Progress { done, total } = fit.advance(budget);
    if let Some(out) = out {
        out.put(glimpse_progress { done, total });
    }
    Ok(())
}

/// Finishes a complete fit. Checks that all values, and the fitted material at every reading, are finite and
/// plausible.
///
/// After GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_IMPLAUSIBLE_OTHER (84 to 91) the fit has a result, but it
/// is unlikely to describe a material: check the sensor. The residual is written, and the
/// glimpse_fitted_...() functions return the result, as after GLIMPSE_STATUS_OK.
///
/// @param scan      The scan.
/// @param residual  Receives the residual, or null.
/// @return GLIMPSE_STATUS_NO_FIT if no fit is under way; GLIMPSE_STATUS_UNFINISHED if it is not
///         complete; GLIMPSE_STATUS_DIVERGED if a number is not finite: the readings stay, and the fit
///         ends; GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_IMPLAUSIBLE_OTHER if the result is
///         implausible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fit_finish(
    scan: *mut glimpse_scan,
    residual: *mut glimpse_residual,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { finish(scan, residual) })
}

unsafe fn finish(
    scan: *mut glimpse_scan,
    residual: *mut glimpse_residual,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (scan, out) = unsafe { (exclusive(scan.cast::<CScan>())?, Out::optional(residual)?) };
    let fit = scan.fit_under_way().ok_or(glimpse_status::NoFit)?;
    let finished = fit.finish().map(|_| ());
    // An implausible material has a residual, too.
    if let (Some(out), Some(fitted)) = (out, scan.fitted()) {
        out.put(fitted.residual().into());
    }
    Ok(finished?)
}

/// Returns the residual of the last fit.
///
/// @param scan      The scan.
/// @param residual  Receives the residual.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_residual(
    scan: *const glimpse_scan,
    residual: *mut glimpse_residual,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(residual)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.residual().into());
        Ok(())
    }))
}

/// Returns the loss predicted from this material's readings: an error bar. Only recipes that complete
/// readings predict it.
///
/// @param scan  The scan.
/// @param loss  Receives the mean of |ln(1 + f cos(theta_i)) - ln(1 + f_fitted cos(theta_i))| over all
///              directions; NAN if the recipe predicts none, or if it is too large for a float.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_predicted_loss(
    scan: *const glimpse_scan,
    loss: *mut f32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(loss)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.predicted_loss().unwrap_or(f32::NAN));
        Ok(())
    }))
}

/// Returns the upper bound of this material's loss, which holds for 90 % of materials. Only recipes that
/// predict the loss can state it.
///
/// @param scan   The scan.
/// @param bound  Receives the bound of the mean that glimpse_fitted_predicted_loss() predicts; NAN if the
///               recipe does not state it, or if it is too large for a float.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_loss_bound(
    scan: *const glimpse_scan,
    bound: *mut f32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(bound)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.loss_bound().unwrap_or(f32::NAN));
        Ok(())
    }))
}

/// Compares this material's readings with those of the training. If they are unlike those of all training
/// materials, the predicted loss and its bound are uncertain.
///
/// @param scan    The scan.
/// @param unlike  Receives GLIMPSE_ANSWER_YES if the readings are unlike, GLIMPSE_ANSWER_NO if not;
///                GLIMPSE_ANSWER_UNKNOWN if the recipe cannot tell.
/// @return GLIMPSE_STATUS_NOT_FITTED if no fit has been finished since the last reading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_fitted_is_unlike_training(
    scan: *const glimpse_scan,
    unlike: *mut glimpse_answer,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (scan, out) = unsafe { (shared(scan.cast::<CScan>()), Out::new(unlike)) };
    status(scan.and_then(|scan| {
        let fitted = scan.fitted().ok_or(glimpse_status::NotFitted);
        let out = out?;
        out.put(fitted?.is_unlike_training().into());
        Ok(())
    }))
}

/// Returns the fitted material's BRDF.
///
/// @param scan        The scan.
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
    status(unsafe { self::brdf(scan, directions, brdf) })
}

unsafe fn brdf(
    scan: *const glimpse_scan,
    directions: *const glimpse_directions,
    brdf: *mut [f32; 3],
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (scan, directions, out) = unsafe {
        (
            shared(scan.cast::<CScan>())?,
            copy_of(directions)?,
            Out::new(brdf)?,
        )
    };
    let fitted = scan.fitted().ok_or(glimpse_status::NotFitted)?;
    let directions = directions.into();
    let Some(brdf) = fitted.brdf(&directions) else {
        return Err(match (is_above(&directions), scan.recipe().model()) {
            (false, _) => glimpse_status::Directions,
            (true, ModelKind::Linear) if scan.basis().is_none() => glimpse_status::NoBasis,
            // The value is too large for a float.
            (true, _) => glimpse_status::Diverged,
        });
    };
    out.put(brdf);
    Ok(())
}

/// Returns true if both directions are above the horizon by more than rounding errors.
fn is_above(directions: &Directions<f32>) -> bool {
    const GRAZING: f32 = 1e-5; // cosine
    let Directions {
        incoming: [.., cos_theta_i],
        outgoing: [.., cos_theta_o],
    } = *directions;
    directions.check().is_ok() && cos_theta_i > GRAZING && cos_theta_o > GRAZING
}

/// Returns the fitted values, all finite: the model's parameters in its order, or Linear's coefficients,
/// m for red, m for green, m for blue. A host renders them.
///
/// @param scan      The scan.
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
    status(unsafe { self::values(scan, values, capacity, count) })
}

unsafe fn values(
    scan: *const glimpse_scan,
    values: *mut f32,
    capacity: usize,
    count: *mut usize,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (scan, count) = unsafe { (shared(scan.cast::<CScan>())?, Out::new(count)?) };
    let fitted = Scan::fitted(scan).ok_or(glimpse_status::NotFitted)?;
    let total = fitted.values().count();
    if total > capacity {
        count.put(total);
        return Err(glimpse_status::BufferTooSmall);
    }
    // SAFETY: this only checks the pointer.
    let first = unsafe { Out::new(values)? };
    for (index, value) in fitted.values().enumerate() {
        // SAFETY: the caller guarantees room for `capacity` values, and `total` is at most `capacity`.
        unsafe { first.put_at(index, value) };
    }
    count.put(total);
    Ok(())
}
