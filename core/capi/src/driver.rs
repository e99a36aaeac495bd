//! The driver: the state machine of a scan, including the link to a host.

use core::ffi::c_void;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Machine};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Saved;

use crate::handle::{
    CDriver, CScan, Handle, Memory, bytes_for, driver as shared, driver_mut, exclusive,
    glimpse_driver, glimpse_scan, scan as scan_of,
};
use crate::pointer::{Out, copy, slice, status};
use crate::scan::slots;
use crate::status::glimpse_status;
use crate::types::{
    glimpse_action, glimpse_action_kind as Kind, glimpse_config, glimpse_host, glimpse_reading,
    glimpse_saved,
};

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

/// Returns the default options: no machine, seed 0, 8 steps per poll, retransmissions after 0.1 s, a timeout
/// of 2 s for replies and of 60 s for readings, three attempts, no storage for recipes, and no target loss.
/// The field `machine` is that of glimpse_machine_default(), without effect until `has_machine` is set.
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
        recipe_bytes: config.recipe_bytes,
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
        if self.has_machine != 0 {
            config.machine = Some(self.machine.validated()?);
        }
        config.sequence_seed = self.sequence_seed;
        config.steps_per_poll = self.steps_per_poll;
        config.retransmit_interval_ms = self.retransmit_interval_ms;
        config.reply_timeout_ms = self.reply_timeout_ms;
        config.measure_timeout_ms = self.measure_timeout_ms;
        config.attempts = self.attempts;
        config.recipe_bytes = self.recipe_bytes;
        if self.target_loss.is_nan() || self.target_loss < 0.0 {
            return Err(glimpse_status::ArgumentTargetLoss);
        }
        config.target_loss = Some(self.target_loss);
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
/// @param saved         Both slots of saved readings, or null. They are restored as by
///                      glimpse_saved_restore(); without intact readings of this recipe, all samples are
///                      read. A host that measures confirms that restored readings are still valid.
///                      The slots are not used after this call.
/// @param driver        Receives the handle, a pointer into the memory; null after an error.
/// @return GLIMPSE_STATUS_MEMORY if the memory is too small for any driver;
///         GLIMPSE_STATUS_ARGUMENT_HOST, GLIMPSE_STATUS_ARGUMENT_MACHINE or
///         GLIMPSE_STATUS_ARGUMENT_TARGET_LOSS if an option is invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    config: *const glimpse_config,
    saved: *const glimpse_saved,
    driver: *mut *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header. Recipe and memory stay valid while the handle is in use.
    status(|| unsafe {
        let out = Out::new(driver)?;
        out.put(core::ptr::null_mut())?;
        let memory = Memory::new(memory, memory_bytes)?;
        let recipe = slice(recipe, recipe_bytes, glimpse_status::ArgumentRecipe)?;
        let config = copy(config, glimpse_status::ArgumentConfig)?.validated()?;
        let slots = match saved.is_null() {
            true => [[].as_slice(); 2],
            false => slots(saved)?,
        };
        let recipe = Recipe::parse(recipe);
        out.put(begin(memory, recipe, slots, config).cast())
    })
}

/// Writes a driver. The function is not inlined, so that its temporaries are not on the stack while a recipe is parsed.
#[inline(never)]
fn begin(
    memory: Memory<CDriver>,
    recipe: Result<Recipe<'static>, Error>,
    slots: [&[u8]; 2],
    config: Config,
) -> *mut Handle<CDriver> {
    let scan = recipe.and_then(|recipe| {
        // SAFETY: this is the only call.
        let numbers = unsafe { memory.numbers() };
        CScan::new(recipe, numbers)
    });
    memory.put(match scan {
        Ok(mut scan) => {
            // Without intact readings, the driver reads all samples.
            let _ = Saved::restore(slots, &mut scan);
            Driver::new(scan, config)
        }
        Err(error) => Driver::without_scan(error, config),
    })
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
/// @param now_ms  The time of a monotonic clock with any origin, in ms.
/// @param action  Receives the action.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll(
    driver: *mut glimpse_driver,
    now_ms: u64,
    action: *mut glimpse_action,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (driver, out) = (driver_mut(driver)?, Out::new(action)?);
        out.put(driver.poll(now_ms).into())
    })
}

/// Returns the time until the next necessary poll.
///
/// @param driver    The driver.
/// @param now_ms    The time, as for glimpse_driver_poll().
/// @param delay_ms  Receives the time in ms. UINT32_MAX if there is none: then only a received byte, a
///                  sent byte or another call changes the driver's state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll_delay(
    driver: *const glimpse_driver,
    now_ms: u64,
    delay_ms: *mut u32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let (driver, out) = (shared(driver)?, Out::new(delay_ms)?);
        out.put(driver.poll_delay(now_ms).unwrap_or(u32::MAX))
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
        let (driver, bytes, count) = (shared(driver)?, Out::new(bytes)?, Out::new(count)?);
        let outgoing = driver.outgoing();
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

/// Records a reading of the device's own sensor. Samples may come in any order. After
/// glimpse_config.attempts invalid readings of a sample, the driver skips it if the recipe tolerates missing
/// readings. Otherwise the scan fails.
///
/// @param driver   The driver.
/// @param index    Index of the sample in the pattern.
/// @param reading  The reading; it is copied.
/// @return GLIMPSE_STATUS_READING_... if the reading is invalid: the driver requests it again, so the
///         firmware may ignore this status; GLIMPSE_STATUS_NOT_SCANNING if the scan is finished, has failed
///         or does not exist.
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

/// Skips a sample that cannot be read. A later glimpse_driver_record() of the sample undoes this.
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
/// @param failure  GLIMPSE_STATUS_MACHINE if the device's own arms or sensor failed; GLIMPSE_STATUS_STORAGE
///                 if it could not store a recipe, which the driver then fetches again later.
/// @return GLIMPSE_STATUS_ARGUMENT_FAILURE for another failure: then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_fail(
    driver: *mut glimpse_driver,
    failure: i32,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let driver = driver_mut(driver)?;
        let codes = [ErrorCode::Machine, ErrorCode::Storage];
        let code = codes
            .into_iter()
            .find(|code| i32::from(code.number()) == failure);
        driver.fail(Error::new(code.ok_or(glimpse_status::ArgumentFailure)?));
        Ok(())
    })
}

/// Stops the scan like glimpse_driver_fail(), because the stored recipe is unusable, and reports the reason
/// to the host. Call it after GLIMPSE_ACTION_KIND_INSTALL if glimpse_driver_bytes() of the stored recipe is
/// 0 or larger than this driver's memory. The present recipe stays in use. The driver does not fetch the
/// other one again.
///
/// @param driver  The driver.
/// @param recipe  The stored recipe.
/// @param count   Number of bytes.
/// @return GLIMPSE_STATUS_ARGUMENT_RECIPE if the recipe is usable; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_reject(
    driver: *mut glimpse_driver,
    recipe: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(|| unsafe {
        let handle = exclusive::<CDriver>(driver.cast())?;
        let recipe = slice(recipe, count, glimpse_status::ArgumentRecipe)?;
        let recipe = Recipe::parse(recipe);
        let accepted = recipe.and_then(|recipe| CScan::accept(&recipe, handle.words));
        let error = accepted.err().ok_or(glimpse_status::ArgumentRecipe)?;
        handle.value.fail(error);
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
/// @param scan    Receives the scan; null if there is none.
/// @return GLIMPSE_STATUS_NOT_SCANNING if the driver has no scan, because its recipe is unusable.
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
        scan_of(driver.cast())?;
        out.put(driver.cast())
    })
}

impl From<Action> for glimpse_action {
    fn from(action: Action) -> Self {
        // SAFETY: 0 is a valid value of every field.
        let mut to: Self = unsafe { core::mem::zeroed() };
        to.kind = match action {
            Action::Wait => Kind::Wait,
            Action::Measure { index, directions } => {
                (to.index, to.directions) = (index, directions.into());
                Kind::Measure
            }
            Action::Save { index, reading } => {
                (to.index, to.reading) = (index, reading.into());
                Kind::Save
            }
            Action::Forget => Kind::Forget,
            Action::Store { offset, bytes } => {
                let bytes = bytes.as_slice();
                (to.offset, to.byte_count) = (offset, bytes.len() as u16);
                for (to, from) in to.bytes.iter_mut().zip(bytes) {
                    *to = *from;
                }
                Kind::Store
            }
            Action::Install { bytes, checksum } => {
                (to.offset, to.checksum) = (bytes, checksum);
                Kind::Install
            }
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
