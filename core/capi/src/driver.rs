//! The driver: the state machine of a scan, including the link to a host.

use core::convert::Infallible;
use core::ffi::c_void;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::gonio::Limits;
use glimpse_core::link::Failure;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::configuration::{CDriver, CScan, Fitter};
use crate::pointer::{CallerMemory, Out, bytes_for, copy_of, exclusive, shared, slice, status};
use crate::scan::glimpse_scan;
use crate::status::glimpse_status;
use crate::types::{
    glimpse_action, glimpse_action_kind, glimpse_config, glimpse_directions, glimpse_host,
    glimpse_reading, glimpse_residual, glimpse_saved,
};

/// A driver of scans, in the caller's memory. It takes received bytes, readings and the time, and returns
/// the next action. Motors, sensor, serial line, flash and clock belong to the firmware. Use it from one
/// thread at a time, and not from an interrupt handler that may interrupt a call.
pub struct glimpse_driver {
    _private: (),
}

/// Returns the size of the memory that glimpse_driver_begin() needs with a recipe, in bytes. Returns 0 if
/// this library does not accept the recipe: glimpse_recipe_describe() returns the reason.
/// GLIMPSE_DRIVER_BYTES(0) bytes are enough for a driver without a usable recipe.
///
/// @param recipe  The recipe, with any alignment.
/// @param count   Number of bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_bytes(recipe: *const u8, count: usize) -> usize {
    // SAFETY: the C caller keeps the contract of the header.
    unsafe { bytes_for::<CDriver>(recipe, count) }
}

/// Returns the default options: no limits, seed 0, 8 steps per poll, retransmissions after 0.1 s, a timeout
/// of 2 s for replies and of 60 s for readings, three attempts, no storage for recipes, and no target loss.
///
/// @param host  One of glimpse_host.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_config_default(host: i32) -> glimpse_config {
    let config = Config::new(Host::Absent);
    glimpse_config {
        host,
        has_limits: u8::from(config.limits.is_some()),
        attempts: config.attempts,
        limits: config.limits.unwrap_or(Limits::NONE).into(),
        sequence_seed: config.sequence_seed,
        steps_per_poll: config.steps_per_poll,
        retransmit_interval_ms: config.retransmit_interval_ms,
        reply_timeout_ms: config.reply_timeout_ms,
        measure_timeout_ms: config.measure_timeout_ms,
        recipe_bytes: config.recipe_bytes,
        target_loss: config.target_loss.unwrap_or_default(),
    }
}

impl glimpse_config {
    fn validated(&self) -> Result<Config, glimpse_status> {
        let mut config = Config::new(match self.host {
            host if host == glimpse_host::Measures as i32 => Host::Measures,
            host if host == glimpse_host::Listens as i32 => Host::Listens,
            host if host == glimpse_host::Absent as i32 => Host::Absent,
            _ => return Err(glimpse_status::Argument),
        });
        if self.has_limits != 0 {
            let limits = Limits::from(self.limits);
            limits.validate().map_err(|_| glimpse_status::Argument)?;
            config.limits = Some(limits);
        }
        config.sequence_seed = self.sequence_seed;
        config.steps_per_poll = self.steps_per_poll;
        config.retransmit_interval_ms = self.retransmit_interval_ms;
        config.reply_timeout_ms = self.reply_timeout_ms;
        config.measure_timeout_ms = self.measure_timeout_ms;
        config.attempts = self.attempts;
        config.recipe_bytes = self.recipe_bytes;
        if self.target_loss.is_nan() || self.target_loss < 0.0 {
            return Err(glimpse_status::Argument);
        }
        config.target_loss = Some(self.target_loss).filter(|target| *target > 0.0);
        Ok(config)
    }
}

/// Begins a driver. Memory and recipe are as for glimpse_scan_begin().
///
/// An unusable recipe is not an error here: it may be damaged, have another model, or need more memory. The
/// driver then reports the failure to the host, requests another recipe if it can store one, and
/// returns GLIMPSE_ACTION_KIND_FAILED. Without a recipe, pass null and 0.
///
/// @param memory        The caller's memory, aligned to GLIMPSE_ALIGNMENT.
/// @param memory_bytes  Its size: glimpse_driver_bytes() of the recipe.
/// @param recipe        The recipe, which must not change while the driver is in use.
/// @param recipe_bytes  Number of bytes of the recipe.
/// @param config        The options; they are copied.
/// @param saved         Saved readings with this recipe (see glimpse_recipe.checksum); they are copied. A host
///                      that measures confirms that they are still valid. Invalid readings are ignored.
///                      May be null if saved_count is 0.
/// @param saved_count   Number of saved readings.
/// @param driver        Receives the handle, a pointer into the memory; null after an error.
/// @return GLIMPSE_STATUS_MEMORY_TOO_SMALL if the memory is too small for any driver;
///         GLIMPSE_STATUS_ARGUMENT if the host is unknown, the limits are invalid, or the target loss is
///         negative or NaN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    config: *const glimpse_config,
    saved: *const glimpse_saved,
    saved_count: usize,
    driver: *mut *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe {
        Out::new(driver).and_then(|out| {
            out.put(core::ptr::null_mut());
            let recipe = slice(recipe, recipe_bytes)?;
            let config = copy_of(config)?.validated()?;
            let saved = slice(saved, saved_count)?;
            let memory = CallerMemory::<CDriver>::new(memory, memory_bytes)?;
            out.put(begin(memory, recipe, config, saved).cast());
            Ok(())
        })
    })
}

fn begin(
    memory: CallerMemory<CDriver>,
    recipe: &'static [u8],
    config: Config,
    saved: &[glimpse_saved],
) -> *mut CDriver {
    let words = memory.words();
    let accepted = accept(recipe, words);
    let needed = accepted.as_ref().map_or(0, |(_, needed)| *needed);
    let handle = memory.put(needed, |numbers| {
        let scan = accepted.and_then(|(recipe, _)| {
            let mut scan = Scan::new(recipe, numbers).map_err(Failure::Scan)?;
            for saved in saved {
                let _ = scan.record(saved.index, saved.reading.into());
            }
            Ok(scan)
        });
        let driver = match scan {
            Ok(scan) => Driver::new(scan, config),
            Err(failure) => Driver::without_scan(failure, config),
        };
        Ok::<_, Infallible>(CDriver { driver, words })
    });
    match handle {
        Ok(handle) => handle,
    }
}

/// Parses a recipe. Also returns the words of memory that it needs. Fails if they are more than `words`.
fn accept(recipe: &[u8], words: usize) -> Result<(Recipe<'_>, usize), Failure> {
    let recipe = Recipe::parse(recipe).map_err(Failure::Recipe)?;
    let needed = CScan::accept(&recipe, words).map_err(Failure::Scan)?;
    Ok((recipe, needed))
}

/// Advances the driver and returns the firmware's next action. Call it repeatedly; a call takes at most the
/// time of steps_per_poll units of the fit.
///
/// @param driver  The driver.
/// @param now_ms  The time of a monotonic clock with any origin, in ms.
/// @param action  Receives the action.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll(
    driver: *mut glimpse_driver,
    now_ms: u64,
    action: *mut glimpse_action,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, out) = unsafe { (exclusive(driver.cast::<CDriver>()), Out::new(action)) };
    status(out.and_then(|out| {
        out.put(driver?.driver.poll(now_ms).into());
        Ok(())
    }))
}

/// Returns the time until the next timeout of the driver.
///
/// @param driver    The driver.
/// @param now_ms    The time, as for glimpse_driver_poll().
/// @param delay_ms  Receives the time in ms. UINT32_MAX if no timeout is set: then only a received byte, a
///                  sent byte or another call changes the driver's state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll_delay(
    driver: *const glimpse_driver,
    now_ms: u64,
    delay_ms: *mut u32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, out) = unsafe { (shared(driver.cast::<CDriver>()), Out::new(delay_ms)) };
    status(out.and_then(|out| {
        out.put(driver?.driver.poll_delay(now_ms).unwrap_or(u32::MAX));
        Ok(())
    }))
}

/// Takes bytes that were received from the serial line.
///
/// @param driver  The driver.
/// @param bytes   The bytes; may be null if count is 0.
/// @param count   Number of bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_receive(
    driver: *mut glimpse_driver,
    bytes: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, bytes) = unsafe { (exclusive(driver.cast::<CDriver>()), slice(bytes, count)) };
    status(driver.and_then(|driver| {
        for byte in bytes? {
            driver.driver.receive(*byte);
        }
        Ok(())
    }))
}

/// Returns the bytes to send. Send as many as possible, then call glimpse_driver_sent(). Until then the
/// bytes are valid only if no other function changes this driver.
///
/// @param driver  The driver.
/// @param bytes   Receives a pointer to the bytes in the driver's memory; do not write to them.
/// @param count   Receives their number, which may be 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_outgoing(
    driver: *const glimpse_driver,
    bytes: *mut *const u8,
    count: *mut usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe {
        shared(driver.cast::<CDriver>()).and_then(|driver| {
            let (bytes, count) = (Out::new(bytes)?, Out::new(count)?);
            let outgoing = driver.driver.outgoing();
            bytes.put(outgoing.as_ptr());
            count.put(outgoing.len());
            Ok(())
        })
    })
}

/// Marks the first outgoing bytes as sent.
///
/// @param driver  The driver.
/// @param count   Number of bytes. If it exceeds the number of outgoing bytes, all are marked.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_sent(
    driver: *mut glimpse_driver,
    count: usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(|driver| driver.driver.sent(count)))
}

/// Takes a reading of the device's own sensor, at most one between two polls. The driver requests an
/// invalid reading again, up to glimpse_config.attempts times. A scan that has failed ignores readings.
///
/// @param driver   The driver.
/// @param index    Index of the sample in the pattern.
/// @param reading  The reading; it is copied.
/// @return GLIMPSE_STATUS_NO_SCAN if the driver has no scan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_record(
    driver: *mut glimpse_driver,
    index: u16,
    reading: *const glimpse_reading,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, reading) = unsafe { (with_scan(driver), copy_of(reading)) };
    status(driver.and_then(|driver| {
        driver.record(index, reading?.into());
        Ok(())
    }))
}

/// Skips a sample that cannot be read. A later glimpse_driver_record() of the sample undoes this. After the
/// scan has failed, this function has no effect.
///
/// @param driver  The driver.
/// @param index   Index of the sample in the pattern.
/// @return As glimpse_scan_skip(), or GLIMPSE_STATUS_NO_SCAN if the driver has no scan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_skip(
    driver: *mut glimpse_driver,
    index: u16,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let driver = unsafe { with_scan(driver) };
    status(driver.and_then(|driver| Ok(driver.skip(index)?)))
}

/// Skips all pending samples, so that the fit uses the readings taken so far. After the scan has failed,
/// this function has no effect.
///
/// @param driver  The driver.
/// @return As glimpse_scan_finish_early(), or GLIMPSE_STATUS_NO_SCAN if the driver has no scan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_finish_early(
    driver: *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let driver = unsafe { with_scan(driver) };
    status(driver.and_then(|driver| Ok(driver.finish_early()?)))
}

/// Returns the driver behind a handle if it has a scan, else `NoScan`.
///
/// # Safety
/// As [`exclusive`].
unsafe fn with_scan<'a>(
    driver: *mut glimpse_driver,
) -> Result<&'a mut Driver<'static, Fitter>, glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let driver = unsafe { &mut exclusive(driver.cast::<CDriver>())?.driver };
    match driver.scan() {
        Ok(_) => Ok(driver),
        Err(_) => Err(glimpse_status::NoScan),
    }
}

/// Ends the scan with GLIMPSE_STATUS_MACHINE, because the device's own arms or sensor failed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_fail(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(|driver| driver.driver.fail(Failure::Machine)))
}

/// Reports to the host that the stored recipe is unusable, with the reason. Call it after
/// GLIMPSE_ACTION_KIND_INSTALL if glimpse_driver_bytes() of the stored recipe is 0 or larger than this
/// driver's memory. The present recipe stays in use, and the driver does not fetch the other one again.
///
/// @param driver  The driver.
/// @param recipe  The stored recipe.
/// @param count   Number of bytes.
/// @return GLIMPSE_STATUS_ARGUMENT if the recipe is usable; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_reject(
    driver: *mut glimpse_driver,
    recipe: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, recipe) = unsafe { (exclusive(driver.cast::<CDriver>()), slice(recipe, count)) };
    status(
        driver.and_then(|driver| match accept(recipe?, driver.words) {
            Ok(_) => Err(glimpse_status::Argument),
            Err(failure) => {
                driver.driver.fail(failure);
                Ok(())
            }
        }),
    )
}

/// Begins a scan of the next material.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_restart(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(|driver| driver.driver.restart()))
}

/// Returns the driver's scan, for functions that take a const glimpse_scan. It must not be changed, and is
/// valid until the next call that changes the driver.
///
/// @param driver  The driver.
/// @param scan    Receives the scan; null if there is none.
/// @return GLIMPSE_STATUS_NO_SCAN if the driver has no scan, because its recipe is unusable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_scan(
    driver: *const glimpse_driver,
    scan: *mut *const glimpse_scan,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    let (driver, out) = unsafe { (shared(driver.cast::<CDriver>()), Out::new(scan)) };
    status(out.and_then(|out| {
        out.put(core::ptr::null());
        let scan = driver?.driver.scan().map_err(|_| glimpse_status::NoScan)?;
        let scan: *const CScan = scan;
        out.put(scan.cast());
        Ok(())
    }))
}

impl From<Action> for glimpse_action {
    fn from(action: Action) -> Self {
        let nothing = Self {
            kind: glimpse_action_kind::Continue,
            failure: glimpse_status::Ok,
            offset: 0,
            checksum: 0,
            directions: glimpse_directions::default(),
            reading: glimpse_reading::default(),
            residual: glimpse_residual::default(),
            index: 0,
            byte_count: 0,
            bytes: [0; 60],
        };
        match action {
            Action::Continue => nothing,
            Action::Wait => Self {
                kind: glimpse_action_kind::Wait,
                ..nothing
            },
            Action::Measure { index, directions } => Self {
                kind: glimpse_action_kind::Measure,
                index,
                directions: directions.into(),
                ..nothing
            },
            Action::Save { index, reading } => Self {
                kind: glimpse_action_kind::Save,
                index,
                reading: reading.into(),
                ..nothing
            },
            Action::Forget => Self {
                kind: glimpse_action_kind::Forget,
                ..nothing
            },
            Action::Store { offset, bytes } => {
                let bytes = bytes.as_slice();
                let mut action = Self {
                    kind: glimpse_action_kind::Store,
                    offset,
                    byte_count: bytes.len() as u16,
                    ..nothing
                };
                for (to, from) in action.bytes.iter_mut().zip(bytes) {
                    *to = *from;
                }
                action
            }
            Action::Install { bytes, checksum } => Self {
                kind: glimpse_action_kind::Install,
                offset: bytes,
                checksum,
                ..nothing
            },
            Action::Finished(residual) => Self {
                kind: glimpse_action_kind::Finished,
                residual: residual.into(),
                ..nothing
            },
            Action::Failed(failure) => Self {
                kind: glimpse_action_kind::Failed,
                failure: failure.into(),
                ..nothing
            },
            // Actions of a newer core may be ignored.
            _ => nothing,
        }
    }
}
