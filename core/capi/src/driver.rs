//! The driver: what every scanner's firmware does, the link to a host included.

use core::ffi::c_void;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::Failure;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::configuration::{CDriver, CMemory, CScan};
use crate::place::{Out, Place, exclusive, get, list, shared, status};
use crate::scan::glimpse_scan;
use crate::status::glimpse_status;
use crate::types::{
    glimpse_action, glimpse_action_kind, glimpse_config, glimpse_directions, glimpse_host,
    glimpse_kept, glimpse_reading, glimpse_residual,
};

/// Leads scans from the first word to the last, in the caller's memory: it is fed with bytes from
/// the line, readings and elapsed time, and says what is to be done next. Motors, sensor, line, flash
/// and clock are the firmware's. It is used by one thread at a time, and by no interrupt that may come
/// during a call.
pub struct glimpse_driver {
    _private: (),
}

/// How many bytes of memory glimpse_driver_begin() takes as the library was built;
/// GLIMPSE_DRIVER_BYTES is no less if C's macros say the same.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_driver_bytes() -> usize {
    size_of::<Place<CDriver>>()
}

/// What serves most: slices of 8 units, repeats after 0.1 s, patience of 2 s, of a minute for
/// readings, three attempts, no storage for recipes.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_config_default(host: i32) -> glimpse_config {
    let Config {
        host: _,
        slice,
        repeat,
        patience,
        measuring_patience,
        attempts,
        recipe_bytes,
    } = Config::new(Host::Absent);
    glimpse_config {
        host,
        slice,
        repeat,
        patience,
        measuring_patience,
        recipe_bytes,
        attempts,
    }
}

impl glimpse_config {
    fn check(&self) -> Result<Config, glimpse_status> {
        let host = match self.host {
            host if host == glimpse_host::Measures as i32 => Host::Measures,
            host if host == glimpse_host::Listens as i32 => Host::Listens,
            host if host == glimpse_host::Absent as i32 => Host::Absent,
            _ => return Err(glimpse_status::Argument),
        };
        Ok(Config {
            host,
            slice: self.slice,
            repeat: self.repeat,
            patience: self.patience,
            measuring_patience: self.measuring_patience,
            attempts: self.attempts,
            recipe_bytes: self.recipe_bytes,
        })
    }
}

/// Begins. Memory and recipe are as for glimpse_scan_begin().
///
/// A recipe that is damaged, or for another library, is no error here: the driver tells the host why,
/// asks it for a better one if it can store one, and says GLIMPSE_ACTION_KIND_FAILED. Without a
/// recipe at all let recipe be null and recipe_bytes 0.
///
/// @param memory        GLIMPSE_DRIVER_BYTES, aligned to GLIMPSE_ALIGNMENT.
/// @param memory_bytes  How many bytes that are.
/// @param recipe        The recipe, which stays as it is while the driver is used.
/// @param recipe_bytes  How many bytes that are.
/// @param config        How it behaves; it is copied.
/// @param kept          Readings by this recipe (see glimpse_recipe.checksum) that outlasted a reset;
///                      they are copied, and a host that measures is asked whether they still hold.
///                      What cannot be a reading is left out. May be null if there are none.
/// @param kept_count    How many there are.
/// @param driver        The handle: a pointer into the memory. Null if there was an error.
/// @return GLIMPSE_STATUS_MEMORY_TOO_SMALL, GLIMPSE_STATUS_ARGUMENT if there is no such host.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_begin(
    memory: *mut c_void,
    memory_bytes: usize,
    recipe: *const u8,
    recipe_bytes: usize,
    config: *const glimpse_config,
    kept: *const glimpse_kept,
    kept_count: usize,
    driver: *mut *mut glimpse_driver,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe {
        Out::new(driver).and_then(|out| {
            out.put(core::ptr::null_mut());
            let recipe = list(recipe, recipe_bytes)?;
            let config = get(config)?.check()?;
            let kept = list(kept, kept_count)?;
            let (handle, memory) = Place::<CDriver>::prepare(memory, memory_bytes)?;
            handle.write(Driver::new(scan(recipe, memory, kept), config));
            out.put(handle.cast());
            Ok(())
        })
    })
}

fn scan(
    recipe: &'static [u8],
    memory: &'static mut CMemory,
    kept: &[glimpse_kept],
) -> Result<CScan, Failure> {
    let recipe = Recipe::parse(recipe).map_err(Failure::Recipe)?;
    let mut scan = Scan::new(recipe, memory).map_err(Failure::Scan)?;
    for kept in kept {
        let _ = scan.record(kept.index, kept.reading.into());
    }
    Ok(scan)
}

/// Does what is next, and says what the firmware has to do. It is called again and again, and takes
/// no longer than a slice of the fit.
///
/// @param driver   The driver.
/// @param elapsed  Milliseconds since the last call; measured from call to call, so that roundings do
///                 not add up.
/// @param action   What is to be done.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_poll(
    driver: *mut glimpse_driver,
    elapsed: u32,
    action: *mut glimpse_action,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (driver, out) = unsafe { (exclusive(driver.cast::<CDriver>()), Out::new(action)) };
    status(out.and_then(|out| {
        out.put(driver?.poll(elapsed).into());
        Ok(())
    }))
}

/// Takes bytes from the line, all of them.
///
/// @param driver  The driver.
/// @param bytes   What was received; may be null if count is 0.
/// @param count   How many bytes that are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_receive(
    driver: *mut glimpse_driver,
    bytes: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (driver, bytes) = unsafe { (exclusive(driver.cast::<CDriver>()), list(bytes, count)) };
    status(driver.and_then(|driver| {
        for byte in bytes? {
            driver.receive(*byte);
        }
        Ok(())
    }))
}

/// Bytes to be sent, none or more. glimpse_driver_sent() says how many were; in between no other
/// function of this driver may be called that changes it.
///
/// @param driver  The driver.
/// @param bytes   Where they are: in the driver's memory, to be read only.
/// @param count   How many there are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_outgoing(
    driver: *const glimpse_driver,
    bytes: *mut *const u8,
    count: *mut usize,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe {
        shared(driver.cast::<CDriver>()).and_then(|driver| {
            let (bytes, count) = (Out::new(bytes)?, Out::new(count)?);
            let outgoing = driver.outgoing();
            bytes.put(outgoing.as_ptr());
            count.put(outgoing.len());
            Ok(())
        })
    })
}

/// So many of the outgoing bytes were sent.
///
/// @param driver  The driver.
/// @param count   How many; more than there are count as all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_sent(
    driver: *mut glimpse_driver,
    count: usize,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(|driver| driver.sent(count)))
}

/// Takes a reading of the device's own sensor. What cannot be one is asked for again, as often as
/// glimpse_config.attempts says.
///
/// @param driver   The driver.
/// @param index    Which sample of the pattern it is.
/// @param reading  What the sensor saw; it is copied.
/// @return GLIMPSE_STATUS_NO_SCAN if the driver has none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_record(
    driver: *mut glimpse_driver,
    index: u16,
    reading: *const glimpse_reading,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (driver, reading) = unsafe { (exclusive(driver.cast::<CDriver>()), get(reading)) };
    status(driver.and_then(|driver| {
        let reading = reading?;
        driver.scan().map_err(|_| glimpse_status::NoScan)?;
        driver.record(index, reading.into());
        Ok(())
    }))
}

/// Gives up on the scan, since the device's own arms or sensor failed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_fail(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(|driver| driver.fail(Failure::Machine)))
}

/// Tells the host why the recipe that it sent is none: after GLIMPSE_ACTION_KIND_INSTALL, if
/// glimpse_recipe_describe() refused it. The present recipe stays in use.
///
/// @param driver  The driver.
/// @param recipe  What was stored.
/// @param count   How many bytes that are.
/// @return GLIMPSE_STATUS_ARGUMENT if glimpse_recipe_describe() accepts it: then nothing has changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_reject(
    driver: *mut glimpse_driver,
    recipe: *const u8,
    count: usize,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (driver, recipe) = unsafe { (exclusive(driver.cast::<CDriver>()), list(recipe, count)) };
    status(driver.and_then(|driver| {
        let accepted = Recipe::parse(recipe?)
            .map_err(Failure::Recipe)
            .and_then(|recipe| CScan::accept(&recipe).map_err(Failure::Scan));
        match accepted {
            Ok(()) => Err(glimpse_status::Argument),
            Err(failure) => {
                driver.fail(failure);
                Ok(())
            }
        }
    }))
}

/// Begins a scan of the next material.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_restart(driver: *mut glimpse_driver) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let driver = unsafe { exclusive(driver.cast::<CDriver>()) };
    status(driver.map(Driver::restart))
}

/// The driver's scan, to look at: for those functions that take a const glimpse_scan. It must not be
/// changed, and is there until the next call that changes the driver.
///
/// @param driver  The driver.
/// @param scan    The scan; null if there is none.
/// @return GLIMPSE_STATUS_NO_SCAN if the driver has none, since its recipe was refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_driver_scan(
    driver: *const glimpse_driver,
    scan: *mut *const glimpse_scan,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    let (driver, out) = unsafe { (shared(driver.cast::<CDriver>()), Out::new(scan)) };
    status(out.and_then(|out| {
        out.put(core::ptr::null());
        let scan: *const CScan = driver?.scan().map_err(|_| glimpse_status::NoScan)?;
        out.put(scan.cast());
        Ok(())
    }))
}

impl From<Action> for glimpse_action {
    fn from(action: Action) -> Self {
        let nothing = Self {
            kind: glimpse_action_kind::Continue,
            failure: glimpse_status::Ok,
            milliseconds: 0,
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
            Action::Wait { milliseconds } => Self {
                kind: glimpse_action_kind::Wait,
                milliseconds,
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
                let mut action = Self {
                    kind: glimpse_action_kind::Store,
                    offset,
                    byte_count: bytes.len() as u16,
                    ..nothing
                };
                for (to, from) in action.bytes.iter_mut().zip(&bytes) {
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
        }
    }
}
