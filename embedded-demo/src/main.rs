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
use glimpse_core::link::{DeviceEnd, FRAME_BYTES, Request};
use glimpse_core::recipe::Recipe;
use glimpse_core::store::Store;

use profiler::Profiler;
use recipe::{MEMORY_WORDS, Scan};
use storage::Retained;
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
    let Some(mut uart) = Uart::start(&mut core.NVIC, &mut core.SCB) else {
        reset(); // unreachable: it is started once
    };
    let clock = Clock::start(core.SYST);
    match begin_scan(MEMORY) {
        Ok((driver, store)) => run(uart, clock, driver, store),
        Err(error) => report(&mut uart, clock, error),
    }
}

/// Parses the recipe, and restores the readings of a scan that a reset interrupted. Not inlined: its stack frame is
/// free again before the scan.
#[inline(never)]
fn begin_scan(
    memory: &'static mut [f32],
) -> Result<(Driver<'static, AnyModel>, Store<Retained>), Error> {
    let mut scan = Scan::new(Recipe::parse(recipe::recipe())?, memory)?;
    let mut store = Store::mount(Retained, storage::LAYOUT, scan.recipe())?;
    let mut config = Config::new(Host::Measures);
    config.sequence_seed = store.count_boot()?;
    let count = store.restore(&mut scan)?;
    defmt::info!("{=u16} readings are saved", count);
    Ok((Driver::new(scan, config), store))
}

/// Reports to the host, each second, that the recipe is unusable.
fn report(uart: &mut Uart, mut clock: Clock, error: Error) -> ! {
    defmt::error!("{}", error);
    let mut frame = [0; FRAME_BYTES];
    let request = Request::Failed(error);
    let frame = DeviceEnd::new(0)
        .request(&request, &mut frame)
        .unwrap_or_default();
    loop {
        for byte in frame {
            while !uart.write(*byte) {}
        }
        let next = clock.now_ms().saturating_add(1000);
        while clock.now_ms() < next {
            time::sleep(|| false);
        }
    }
}

/// The main loop: one iteration for each action of the driver.
fn run(
    mut uart: Uart,
    mut clock: Clock,
    mut driver: Driver<'static, AnyModel>,
    mut store: Store<Retained>,
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
        let stored = match action {
            Action::Wait if driver.outgoing().is_empty() => {
                time::sleep(|| uart.has_byte());
                Ok(())
            }
            Action::Save { index, reading } => store.save(index, reading, true),
            Action::Forget => {
                defmt::info!("all readings are deleted");
                store.clear()
            }
            Action::Finished(residual) => {
                defmt::info!("finished: {}", residual);
                log_loss(&driver);
                profiler.report();
                Ok(())
            }
            Action::Failed(error) => {
                defmt::error!("{}", error);
                profiler.restart();
                go_on(&mut driver, error.code);
                Ok(())
            }
            _ => Ok(()), // the host has the arms and the sensor
        };
        if let Err(error) = stored {
            defmt::warn!("readings are not saved: {}", error);
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
    let Some(fitted) = driver.scan().fitted() else {
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
    let scan = driver.scan();
    scan.next_pending().is_none() && scan.fitted().is_none()
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
