//! The measuring machine: its arms, the calibration of its sensor, and repeated readings.

use glimpse_core::error::ErrorCode;
use glimpse_core::geometry::{Arms, Directions};
use glimpse_core::gonio::{Calibration, Footprint, Limits, Machine, Repeated};

use crate::handle::{glimpse_scan, scan as shared};
use crate::pointer::{Out, check, copy, status};
use crate::status::glimpse_status;
use crate::types::{
    glimpse_arms, glimpse_calibration, glimpse_directions, glimpse_footprint, glimpse_machine,
    glimpse_move, glimpse_reading, glimpse_repeated,
};

/// Returns the directions of two arms. All angles are valid; below the horizon the BRDF is undefined.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_directions_of(arms: glimpse_arms) -> glimpse_directions {
    Arms::from(arms).directions().into()
}

/// Returns a machine without limits, whose four axes move at 1 rad/s, for isotropic samples. Its arms do not
/// swing through the normal.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_machine_default() -> glimpse_machine {
    Machine::new(Limits::NONE).into()
}

impl glimpse_machine {
    pub(crate) fn validated(self) -> Result<Machine, glimpse_status> {
        let machine = Machine::from(self);
        let validated = machine.limits.validate();
        validated.map_err(|_| glimpse_status::ArgumentMachine)?;
        Ok(machine)
    }
}

/// Checks that a machine reaches a pair of directions, within its limits and with its axes.
///
/// @param machine     The machine.
/// @param directions  The directions.
/// @return GLIMPSE_STATUS_MAX_THETA_I to GLIMPSE_STATUS_MISSING_AXIS if they are out of reach;
///         GLIMPSE_STATUS_DIRECTIONS if they have no BRDF; GLIMPSE_STATUS_ARGUMENT_MACHINE if the limits are
///         invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_machine_check(
    machine: *const glimpse_machine,
    directions: *const glimpse_directions,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let machine = copy(machine, glimpse_status::ArgumentMachine)?.validated()?;
        let directions = copy(directions, glimpse_status::ArgumentDirections)?;
        Ok(machine.check(&directions.into())?)
    })
}

/// Returns the pending sample of a scan that the arms reach first. Samples out of reach are ignored. A recipe
/// in path order takes less time in its own order: use glimpse_scan_next() instead.
///
/// @param machine  The machine.
/// @param scan     The scan, or that of a driver.
/// @param from     The position of the arms. Use the result of the previous call, so that azimuths are
///                 continuous.
/// @param move     Receives the sample, the new position of the arms, and the duration.
/// @return GLIMPSE_STATUS_NONE_PENDING if all samples are read or skipped; GLIMPSE_STATUS_OUT_OF_REACH if
///         all pending samples are out of reach; GLIMPSE_STATUS_ARGUMENT_MACHINE if the limits are invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_machine_nearest(
    machine: *const glimpse_machine,
    scan: *const glimpse_scan,
    from: *const glimpse_arms,
    r#move: *mut glimpse_move,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let machine = copy(machine, glimpse_status::ArgumentMachine)?.validated()?;
        let (scan, out) = (shared(scan)?, Out::new(r#move)?);
        let from = copy(from, glimpse_status::ArgumentArms)?.into();
        scan.next_pending().ok_or(glimpse_status::NonePending)?;
        let nearest = machine.nearest(scan.pending(), &from);
        let nearest = nearest.ok_or(ErrorCode::OutOfReach)?;
        out.put(nearest.into())
    })
}

/// Converts counts of the sensor to a reading.
///
/// @param calibration  Counts of dark and white, and the white's reflectance.
/// @param counts       The three counts of the sample: red, green and blue. A monochrome sensor repeats its
///                     count.
/// @param at           Directions of the sample. Unused with GLIMPSE_FOOTPRINT_ANY, and may then be null.
/// @param reading      Receives the reading.
/// @return GLIMPSE_STATUS_CHANNEL_NON_FINITE if counts or their BRDF are not finite;
///         GLIMPSE_STATUS_WHITE_... if the white is invalid; GLIMPSE_STATUS_DIRECTIONS if an arm is at or
///         below the horizon; GLIMPSE_STATUS_ARGUMENT_CALIBRATION if the footprint is unknown.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_calibrate(
    calibration: *const glimpse_calibration,
    counts: *const f32,
    at: *const glimpse_directions,
    reading: *mut glimpse_reading,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let white = copy(calibration, glimpse_status::ArgumentCalibration)?;
        let counts = copy(counts.cast::<[f32; 3]>(), glimpse_status::ArgumentCounts)?;
        let out = Out::new(reading)?;
        let calibration = Calibration::new(white.dark, white.white, white.reflectance)?
            .saturating_at(white.saturation)?;
        let footprint = match white.footprint {
            number if number == glimpse_footprint::Any as i32 => {
                return out.put(calibration.reading(counts)?.into());
            }
            number if number == glimpse_footprint::LightLarger as i32 => Footprint::LightLarger,
            number if number == glimpse_footprint::SensorLarger as i32 => Footprint::SensorLarger,
            _ => return Err(glimpse_status::ArgumentCalibration),
        };
        let at: Directions<f32> = copy(at, glimpse_status::ArgumentDirections)?.into();
        let calibration = calibration.read_once_at(&white.reference.into(), footprint)?;
        out.put(calibration.reading(counts, &at)?.into())
    })
}

/// Adds a reading to the mean and variance of repeated readings. They may be counts or BRDFs. Conversion by
/// glimpse_calibrate() is linear, so the BRDF of the mean counts is the mean of the BRDFs.
///
/// @param repeated   The mean. All fields of a new one are 0.
/// @param reading    The counts or the BRDF of the three channels.
/// @param saturated  Not 0 if the sensor was saturated.
/// @return GLIMPSE_STATUS_CHANNEL_NON_FINITE if a channel is not finite, or too large for the sums. Nothing
///         has changed then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_repeated_add(
    repeated: *mut glimpse_repeated,
    reading: *const f32,
    saturated: u8,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        check(repeated, glimpse_status::ArgumentRepeated)?;
        let sums = repeated.read();
        let reading = copy(reading.cast::<[f32; 3]>(), glimpse_status::ArgumentReading)?;
        let mut next = Repeated {
            count: sums.count,
            mean: sums.mean,
            squares: sums.squares,
            saturated: sums.saturated != 0,
        };
        next.add(reading, saturated != 0)?;
        repeated.write(glimpse_repeated {
            count: next.count,
            saturated: u8::from(next.saturated),
            mean: next.mean,
            squares: next.squares,
            variance: next.variance().unwrap_or([f32::NAN; 3]),
        });
        Ok(())
    })
}
