//! Firmware of a scanner in QEMU: measures a material in a few directions and fits its BRDF.
//!
//! QEMU's netduinoplus2 has an STM32F405, whose clocks it does not model; the template has firmware for boards. Over the
//! UART it requests each reading from the scanner and sends it the fitted values; see `glimpse_core::link` for the
//! messages.
//!
//! Core's `Driver` controls the scan and continues with the next material. This file passes it received bytes and the
//! time, and carries out its actions: it sleeps, saves readings in memory that survives a reset, and logs results and
//! failures.

#![no_std]
#![no_main]

mod log;
mod profiler;
mod recipe;
mod register;
mod storage;
mod time;
mod uart;

use core::panic::PanicInfo;

use cortex_m::Peripherals;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::AnyModel;
use glimpse_core::recipe::Recipe;

use profiler::Profiler;
use recipe::{MEMORY_WORDS, Scan};
use storage::Storage;
use time::Clock;
use uart::Uart;

#[entry]
fn main() -> ! {
    // Memory of readings and fit. (`entry` makes it `&'static mut`.)
    static mut MEMORY: [f32; MEMORY_WORDS] = [0.0; MEMORY_WORDS];

    profiler::paint_stack();
    let Some(mut core) = Peripherals::take() else {
        reset(); // unreachable: they are taken once
    };
    let Some(uart) = Uart::start(&mut core.NVIC, &mut core.SCB) else {
        reset(); // unreachable: it is started once
    };
    let clock = Clock::start(core.SYST);
    let mut config = Config::new(Host::Measures);
    config.sequence_seed = storage::count_boot();
    let (driver, storage) = match begin_scan(MEMORY) {
        Ok((scan, storage)) => (Driver::new(scan, config), Some(storage)),
        Err(error) => {
            // Only another recipe helps. The driver reports the error to the host.
            defmt::error!("{}", error);
            (Driver::without_scan(error, config), None)
        }
    };
    run(uart, clock, driver, storage)
}

/// Parses the recipe, and restores the readings of a scan that a reset interrupted. Not inlined: its stack frame is
/// free again before the scan.
#[inline(never)]
fn begin_scan(memory: &'static mut [f32]) -> Result<(Scan, Storage), Error> {
    let mut scan = Scan::new(Recipe::parse(recipe::recipe())?, memory)?;
    let storage = Storage::restore(&mut scan);
    Ok((scan, storage))
}

/// The main loop: one iteration for each action of the driver.
fn run(
    mut uart: Uart,
    mut clock: Clock,
    mut driver: Driver<'static, AnyModel>,
    mut storage: Option<Storage>,
) -> ! {
    let mut profiler = Profiler::start();
    loop {
        while let Some(byte) = uart.read() {
            driver.receive(byte);
        }
        let now_ms = clock.now_ms();
        let action = match is_fitting(&driver) {
            true => profiler.measure(|| driver.poll(now_ms)),
            false => driver.poll(now_ms),
        };
        while let Some(byte) = driver.outgoing().first()
            && uart.write(*byte)
        {
            driver.sent(1);
        }
        match (action, &mut storage) {
            (Action::Wait, _) if driver.outgoing().is_empty() => {
                time::sleep(|| uart.has_byte());
            }
            (Action::Save { .. }, Some(storage)) => {
                if let Ok(scan) = driver.scan() {
                    storage.write(scan);
                }
            }
            (Action::Forget, Some(storage)) => storage.clear(),
            (Action::Finished(residual), _) => {
                defmt::info!("finished: {}", residual);
                log_loss(&driver);
                profiler.report();
            }
            (Action::Failed(error), _) => {
                defmt::error!("{}", error);
                profiler.restart();
                go_on(&mut driver, error.code);
            }
            // The host has the arms and the sensor, and this firmware stores no other recipe.
            _ => {}
        }
    }
}

/// Continues after a failure. This device has no arms: an operator starts each scan at the host, whose welcome lets it
/// begin. A device with arms of its own would wait for its operator here.
fn go_on(driver: &mut Driver<'static, AnyModel>, failure: ErrorCode) {
    match failure {
        // The same readings would fail again.
        ErrorCode::ReadingNonFinite
        | ErrorCode::ReadingNegative
        | ErrorCode::Incomplete
        | ErrorCode::ReadingsTooLarge
        | ErrorCode::Diverged => driver.restart(),
        _ => driver.resume(),
    }
}

/// Logs the predicted loss of a finished fit and its bound as `name=value` lines, as far as the recipe states them.
fn log_loss(driver: &Driver<'_, AnyModel>) {
    let Some(fitted) = driver.scan().ok().and_then(|scan| scan.fitted()) else {
        return;
    };
    if let Some(loss) = fitted.predicted_loss() {
        defmt::info!("predicted_loss={=f32}", loss);
    }
    if let Some(bound) = fitted.loss_bound() {
        defmt::info!("loss_bound={=f32}", bound);
    }
    if fitted.is_unlike_training() == Some(true) {
        defmt::warn!(
            "the readings are unlike those of the training: the predicted loss is uncertain"
        );
    }
}

/// Returns true from the last reading to the end of the fit.
fn is_fitting(driver: &Driver<'_, AnyModel>) -> bool {
    driver
        .scan()
        .is_ok_and(|scan| scan.next_pending().is_none() && scan.fitted().is_none())
}

/// Restarts the firmware. No code of this firmware panics, so this is a precaution. With the feature `prove-no-panic` it
/// calls an undefined function instead, so a firmware that can panic does not link.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    #[cfg(feature = "prove-no-panic")]
    {
        unsafe extern "C" {
            safe fn panic_is_reachable() -> !;
        }
        panic_is_reachable()
    }
    #[cfg(not(feature = "prove-no-panic"))]
    reset()
}

/// Restarts the firmware after a fault, such as a stack overflow.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    reset()
}

fn reset() -> ! {
    SCB::sys_reset()
}
