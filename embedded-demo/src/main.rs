//! A scanner's firmware: measures a material in a few directions and fits its BRDF.
//!
//! It runs unchanged on a board with an STM32F405 and on QEMU's netduinoplus2. Over the UART it
//! requests each reading from the scanner and sends it the fitted values; see `glimpse_core::link`
//! for the messages. The README in this folder explains how to run, flash and change it.
//!
//! Core's `Driver` leads the scan, from one material to the next. This file gives it bytes and the
//! time, and carries out its actions: it sleeps, saves readings where a reset leaves them, and logs
//! results and failures.

#![no_std]
#![no_main]

mod board;
mod chip;
mod clocks;
mod interrupts;
#[cfg(not(any(feature = "feather", feature = "nucleo")))]
mod log;
mod meter;
mod recipe;
mod register;
mod storage;
mod time;
mod uart;
mod watchdog;
mod wiring;

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
#[cfg(any(feature = "feather", feature = "nucleo"))]
use defmt_rtt as _; // the log, where a debug probe reads it
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::Failure;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan;

use board::Board;
use recipe::{MEMORY_WORDS, Model, RECIPE};
use storage::Storage;

type Scan = scan::Scan<'static, Model>;

#[entry]
fn main() -> ! {
    // Readings and fit. (`entry` makes it `&'static mut`.)
    static mut MEMORY: [f32; MEMORY_WORDS] = [0.0; MEMORY_WORDS];

    let Some(mut board) = board::start() else {
        reset(); // never happens: the board is started once
    };
    let mut config = Config::new(Host::Measures);
    config.sequence_seed = storage::count_boot();
    let (driver, storage) = match begin(MEMORY) {
        Ok((scan, storage)) => (Driver::new(scan, config), Some(storage)),
        Err(failure) => {
            // Only another recipe helps. The driver reports that to the host.
            defmt::error!("{}", failure);
            (Driver::without_scan(failure, config), None)
        }
    };
    run(&mut board, driver, storage)
}

/// Parses the recipe, and takes over the readings of a scan that a reset interrupted. Out of line:
/// its stack is free again before anything is measured.
#[inline(never)]
fn begin(memory: &'static mut [f32]) -> Result<(Scan, Storage), Failure> {
    // Bits in flash may flip after the compiler has seen them, so it may not know them.
    let recipe = Recipe::parse(black_box(RECIPE)).map_err(Failure::Recipe)?;
    let mut scan = Scan::new(recipe, memory).map_err(Failure::Scan)?;
    let storage = Storage::find(scan.recipe());
    for (index, reading) in storage.readings() {
        let _ = scan.record(*index, *reading); // an invalid one is read again
    }
    Ok((scan, storage))
}

/// The main loop: one turn for each action of the driver.
fn run(board: &mut Board, mut driver: Driver<'static, Model>, mut storage: Option<Storage>) -> ! {
    let Board { uart, clock, meter } = board;
    loop {
        watchdog::feed();
        while let Some(byte) = uart.read() {
            driver.receive(byte);
        }
        let now_ms = clock.now_ms();
        let action = match is_fitting(&driver) {
            true => meter.count(|| driver.poll(now_ms)),
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
            (Action::Save { index, reading }, Some(storage)) => storage.insert(index, reading),
            (Action::Forget, Some(storage)) => storage.clear(),
            (Action::Finished(residual), _) => {
                defmt::info!("finished: {}", residual);
                meter.report();
            }
            (Action::Failed(failure), _) => {
                defmt::error!("{}", failure);
                meter.restart();
            }
            // The host has arms and sensor, and this firmware has one recipe.
            _ => {}
        }
    }
}

/// True once all readings are there and until the fit is done.
fn is_fitting(driver: &Driver<'_, Model>) -> bool {
    driver
        .scan()
        .is_ok_and(|scan| scan.next_pending().is_none() && scan.fitted().is_none())
}

/// Nothing in this firmware panics; if something does after all, it restarts.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    reset()
}

/// A fault, such as a stack overflow, restarts it too.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    reset()
}

fn reset() -> ! {
    SCB::sys_reset()
}
