//! The driver: the state machine of a scan, including the link to a host.

use core::ffi::c_void;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Machine};
use glimpse_core::recipe::Recipe;
use glimpse_core::store::Store;

use crate::handle::{
    CDriver, CScan, Handle, Memory, bytes_for, driver as shared, driver_mut, exclusive,
    glimpse_driver, glimpse_scan,
};
use crate::pointer::{Out, copy, slice, status};
use crate::status::glimpse_status;
use crate::store::mount;
use crate::types::{
    glimpse_action, glimpse_action_kind as Kind, glimpse_config, glimpse_flash, glimpse_host,
    glimpse_reading,
};

/// Returns the size of the memory that glimpse_driver_begin() needs with a recipe, in bytes. Returns 0 if
/// this library does not accept the recipe: glimpse_recipe_describe() returns the reason.
///
/// @param recipe  The recipe, with any alignment.
/// @param count   Number of bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_bytes(recipe: *const u8, count: usize) -> usize {
    // SAFETY: the C caller keeps the contract of the header.
    unsafe { bytes_for::<CDriver>(recipe, count) }
}

/// Returns the default options: no machine, seed 0, 8 steps per poll, retransmissions after 0.1 s, a timeout
/// of 2 s for replies and of 60 s for readings, three attempts, no target loss, and limits of 5 % of light
/// with the lamp off, of 5 % of drift, and of a fifth of saturated readings. If the lamp cannot be switched,
/// set `max_dark` to 0. The field `machine` is that of glimpse_machine_default(), without effect until
/// `has_machine` is set.
///
/// @param host  One of glimpse_host.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_config_default(host: i32) -> glimpse_config {
    let config = Config::new(Host::Absent);
    glimpse_config {
        host,
        has_machine: 0,
        attempts: config.attempts,
        machine: Machine::new(Limits::NONE).into(),
        sequence_seed: config.sequence_seed,
        steps_per_poll: config.steps_per_poll,
        retransmit_interval_ms: config.retransmit_interval_ms,
        reply_timeout_ms: config.reply_timeout_ms,
        measure_timeout_ms: config.measure_timeout_ms,
        max_dark: config.limits.dark,
        max_drift: config.limits.drift,
        max_saturated: config.limits.saturated,
        target_loss: 0.0,
    }
}

impl glimpse_config {
    pub(crate) fn validated(&self) -> Result<Config, glimpse_status> {
        let mut config = Config::new(match self.host {
            host if host == glimpse_host::Measures as i32 => Host::Measures,
            host if host == glimpse_host::Listens as i32 => Host::Listens,
            host if host == glimpse_host::Absent as i32 => Host::Absent,
            _ => return Err(glimpse_status::ArgumentHost),
        });
        let machine = (self.has_machine != 0).then(|| self.machine.validated());
        config.machine = machine.transpose()?;
        config.sequence_seed = self.sequence_seed;
        config.steps_per_poll = self.steps_per_poll;
        config.retransmit_interval_ms = self.retransmit_interval_ms;
        config.reply_timeout_ms = self.reply_timeout_ms;
        config.measure_timeout_ms = self.measure_timeout_ms;
        config.attempts = self.attempts;
        config.limits.dark = self.max_dark;
        config.limits.drift = self.max_drift;
        config.limits.saturated = self.max_saturated;
        if self.target_loss.is_nan() || self.target_loss < 0.0 {
            return Err(glimpse_status::ArgumentTargetLoss);
        }
        config.target_loss = Some(self.target_loss);
        Ok(config)
    }
}

/// Begins a driver. Memory and recipe are as for glimpse_scan_begin().
///
/// @param memory        The caller's memory, aligned to GLIMPSE_ALIGNMENT.
/// @param memory_bytes  Its size: glimpse_driver_bytes() of the recipe.
/// @param recipe        The recipe, which must not change while the driver is in use.
/// @param recipe_bytes  Number of bytes of the recipe.
/// @param config        The options; they are copied.
/// @param flash         The flash with saved readings of an interrupted scan, or null. They are restored as by
///                      glimpse_store_restore(). A host that measures confirms that they are still valid.
///                      With other hosts, pass it only if the material is the same. It is not used after
///                      this call.
/// @param driver        Receives the handle, a pointer into the memory; null after an error. An error of the
///                      flash may end the use of an earlier handle in the memory.
/// @return As glimpse_scan_begin() and glimpse_store_restore(); GLIMPSE_STATUS_ARGUMENT_HOST,
///         GLIMPSE_STATUS_ARGUMENT_MACHINE or GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS if an option is invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    config: *const glimpse_config,
    flash: *const glimpse_flash,
    driver: *mut *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header. Recipe and memory stay valid while the handle is in use.
    status(|| unsafe {
        let out = Out::new(driver)?;
        out.put(core::ptr::null_mut())?;
        let memory = Memory::new(memory, memory_bytes)?;
        let recipe = Recipe::parse(slice(recipe, recipe_bytes, glimpse_status::ArgumentRecipe)?)?;
        out.put(begin(memory, &recipe, config, flash)?.cast())
    })
}

// The next functions are not inlined, so that their temporaries are not on the stack during calls that need more of it:
// while a recipe is parsed, and while the store writes.

/// Begins a driver with a valid recipe.
///
/// # Safety
/// As [`copy`] and [`mount`], but `flash` may be null.
#[inline(never)]
unsafe fn begin(
    memory: Memory<CDriver>,
    recipe: &Recipe<'static>,
    config: *const glimpse_config,
    flash: *const glimpse_flash,
) -> Result<*mut Handle<CDriver>, glimpse_status> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let config = copy(config, glimpse_status::ArgumentConfig)?.validated()?;
        CScan::accept(recipe, memory.words)?;
        let mut store = match flash.is_null() {
            true => None,
            false => Some(mount(flash, recipe)?),
        };
        put(memory, recipe, store.as_mut(), &config)
    }
}

/// Restores readings, and writes a driver.
#[inline(never)]
fn put(
    memory: Memory<CDriver>,
    recipe: &Recipe<'static>,
    store: Option<&mut Store<glimpse_flash>>,
    config: &Config,
) -> Result<*mut Handle<CDriver>, glimpse_status> {
    // SAFETY: this is the only call.
    let mut scan = CScan::new(*recipe, unsafe { memory.numbers() })?;
    store.map_or(Ok(0), |store| store.restore(&mut scan))?;
    let (driver, polled_at) = (Driver::new(scan, *config), 0);
    Ok(memory.put(CDriver { driver, polled_at }))
}

/// Ends a driver. Its memory can be used for anything else. Further calls with the handle return
/// GLIMPSE_STATUS_STALE, as long as the memory is not overwritten with the same bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_end(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { exclusive::<CDriver>(driver.cast()).map(|handle| handle.tag = 0) })
}

/// Advances the driver and returns the firmware's next action. Call it repeatedly; a call takes at most the
/// time of steps_per_poll units of the fit.
///
/// @param driver  The driver.
/// @param now_ms  The time of a monotonic clock with any origin, in ms. After UINT32_MAX it continues with 0,
///                as that of HAL_GetTick() does after 49.7 days.
/// @param action  Receives the action.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll(
    driver: *mut glimpse_driver,
    now_ms: u32,
    action: *mut glimpse_action,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let handle = &mut exclusive::<CDriver>(driver.cast())?.value;
        let out = Out::new(action)?;
        handle.polled_at = handle.time(now_ms);
        out.put(handle.driver.poll(handle.polled_at).into())
    })
}

/// Returns the time until the next necessary poll.
///
/// @param driver    The driver.
/// @param now_ms    The time, as for glimpse_driver_poll(), at or after the last poll.
/// @param delay_ms  Receives the time in ms. UINT32_MAX if there is none: then only a received byte, a
///                  sent byte or another call changes the driver's state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll_delay(
    driver: *const glimpse_driver,
    now_ms: u32,
    delay_ms: *mut u32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (handle, out) = (shared(driver)?, Out::new(delay_ms)?);
        let delay = handle.driver.poll_delay(handle.time(now_ms));
        out.put(delay.unwrap_or(u32::MAX))
    })
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
    status(|| unsafe {
        let driver = driver_mut(driver)?;
        for byte in slice(bytes, count, glimpse_status::ArgumentBytes)? {
            driver.receive(*byte);
        }
        Ok(())
    })
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
    status(|| unsafe {
        let (handle, bytes, count) = (shared(driver)?, Out::new(bytes)?, Out::new(count)?);
        let outgoing = handle.driver.outgoing();
        bytes.put(outgoing.as_ptr())?;
        count.put(outgoing.len())
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
    status(|| unsafe { driver_mut(driver).map(|driver| driver.sent(count)) })
}

/// Records a reading of the device's own sensor. Samples may come in any order. If the driver has requested a
/// reading for another purpose than GLIMPSE_PURPOSE_SAMPLE, a reading with its index is that one. After
/// glimpse_config.attempts invalid readings of a sample, the driver skips it if the recipe tolerates missing
/// readings. Otherwise the scan fails.
///
/// @param driver   The driver.
/// @param index    Index of the sample in the pattern.
/// @param reading  The reading; it is copied.
/// @return GLIMPSE_STATUS_READING_... if the reading is invalid: the driver requests it again, so the
///         firmware may ignore this status; GLIMPSE_STATUS_NOT_SCANNING if the scan is finished or has
///         failed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_record(
    driver: *mut glimpse_driver,
    index: u16,
    reading: *const glimpse_reading,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let driver = driver_mut(driver)?;
        let reading = copy(reading, glimpse_status::ArgumentReading)?;
        Ok(driver.record(index, reading.into())?)
    })
}

/// Skips a sample that cannot be read. A later glimpse_driver_record() of the sample undoes this. If the
/// driver has requested a reading for another purpose with this index, it goes on without that one.
///
/// @param driver  The driver.
/// @param index   Index of the sample in the pattern.
/// @return As glimpse_scan_skip(), or GLIMPSE_STATUS_NOT_SCANNING as glimpse_driver_record().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_skip(
    driver: *mut glimpse_driver,
    index: u16,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { Ok(driver_mut(driver)?.skip(index)?) })
}

/// Skips all pending samples, so that the fit uses only the recorded readings.
///
/// @param driver  The driver.
/// @return As glimpse_scan_finish_early(), or GLIMPSE_STATUS_NOT_SCANNING as glimpse_driver_record().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_finish_early(
    driver: *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { Ok(driver_mut(driver)?.finish_early()?) })
}

/// Stops the scan because of a failure, and keeps its readings. The driver reports the failure to the host.
/// It requests no further move until glimpse_driver_resume() or glimpse_driver_restart().
///
/// @param driver   The driver.
/// @param failure  The failure of the device's own arms, sensor or lamp, or its operator's stop:
///                 GLIMPSE_STATUS_MACHINE, or GLIMPSE_STATUS_STOPPED to GLIMPSE_STATUS_NOT_CALIBRATED (128 to
///                 148); GLIMPSE_STATUS_STORAGE if its flash failed.
/// @param first    The first detail of this failure in the table of core/src/error.rs, which the host
///                 displays; 0 if it has none. Axes have the numbers 0 to 3, in the order of glimpse_arms.
/// @param second   The second detail.
/// @return GLIMPSE_STATUS_ARGUMENT_FAILURE for another failure: then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_fail(
    driver: *mut glimpse_driver,
    failure: i32,
    first: u32,
    second: u32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let driver = driver_mut(driver)?;
        let code = ErrorCode::from_number(u16::try_from(failure).unwrap_or_default());
        let is_valid = code.is_machine() || code == ErrorCode::Storage;
        let error = is_valid.then_some(Error::with(code, [first, second]));
        driver.fail(error.ok_or(glimpse_status::ArgumentFailure)?);
        Ok(())
    })
}

/// Continues a scan that has failed, with the readings that it has. With a host, the driver greets it after
/// a pause of 0.5 s, which doubles with each failure, up to 30 s. A success, such as a valid reading, ends
/// the pauses. Without a failure, the call has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_resume(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { driver_mut(driver).map(Driver::resume) })
}

/// Begins a scan of the next material. If readings were saved, the next poll returns
/// GLIMPSE_ACTION_KIND_FORGET.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_restart(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe { driver_mut(driver).map(Driver::restart) })
}

/// Returns the driver's scan, for functions that take a const glimpse_scan. It shows the present state of the
/// driver at any time. Functions that change a scan refuse it with GLIMPSE_STATUS_READ_ONLY.
///
/// @param driver  The driver.
/// @param scan    Receives the scan; null after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_scan(
    driver: *const glimpse_driver,
    scan: *mut *const glimpse_scan,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let out = Out::new(scan)?;
        out.put(core::ptr::null())?;
        shared(driver)?;
        out.put(driver.cast())
    })
}

impl From<Action> for glimpse_action {
    fn from(action: Action) -> Self {
        // SAFETY: 0 is a valid value of every field.
        let mut to: Self = unsafe { core::mem::zeroed() };
        to.kind = match action {
            Action::Wait => Kind::Wait,
            Action::Measure {
                purpose,
                index,
                directions,
            } => {
                (to.purpose, to.index) = (purpose as i32, index);
                to.directions = directions.into();
                Kind::Measure
            }
            Action::Save { index, reading } => {
                (to.index, to.has_reading) = (index, reading.is_some().into());
                to.reading = reading.map_or(to.reading, From::from);
                Kind::Save
            }
            Action::Forget => Kind::Forget,
            Action::Finished(residual) => {
                to.residual = residual.into();
                Kind::Finished
            }
            Action::Failed(error) => {
                to.failure = error.into();
                Kind::Failed
            }
            // Actions of a newer core may be ignored.
            _ => Kind::Continue,
        };
        to
    }
}
