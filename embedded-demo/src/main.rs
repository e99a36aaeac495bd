//! A scanner's firmware: measures a material in a few directions and fits its BRDF.
//!
//! It runs unchanged on a board with an STM32F405 and on QEMU's netduinoplus2. Over the UART it
//! asks the scanner for each reading and tells it the fitted values; see `glimpse_core::link` for
//! what is said. The README beside this folder says how to run, flash and change it.
//!
//! Core's `Driver` leads the scan, from one material to the next; this file gives it bytes and
//! time, and does what it says: sleeps, keeps readings where a reset leaves them, logs what is
//! done and what failed.

#![no_std]
#![no_main]

mod board;
mod chip;
mod clocks;
mod interrupts;
mod kept;
#[cfg(not(any(feature = "feather", feature = "nucleo")))]
mod log;
mod meter;
mod recipe;
mod register;
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
use kept::Kept;
use recipe::{CAPACITY, Model, RECIPE};

type Memory = scan::Memory<Model, CAPACITY>;
type Scan = scan::Scan<'static, Model>;

#[entry]
fn main() -> ! {
    // Readings and fit. (`entry` makes it `&'static mut`.)
    static mut MEMORY: Memory = Memory::new();

    let Some(mut board) = board::start() else {
        reset(); // cannot be: it is started once
    };
    let (scan, kept) = match begin(MEMORY) {
        Ok((scan, kept)) => (Ok(scan), Some(kept)),
        Err(failure) => {
            // Nothing helps but another recipe. The driver says so to whoever listens.
            defmt::error!("{}", failure);
            (Err(failure), None)
        }
    };
    run(
        &mut board,
        Driver::new(scan, Config::new(Host::Measures)),
        kept,
    )
}

/// Reads the recipe, and takes over the readings of a scan that a reset interrupted. Out of line:
/// what that takes of the stack is given back before anything is measured.
#[inline(never)]
fn begin(memory: &'static mut Memory) -> Result<(Scan, Kept), Failure> {
    // Bits in flash may flip after the compiler has seen them, so it may not know them.
    let recipe = Recipe::parse(black_box(RECIPE)).map_err(Failure::Recipe)?;
    let mut scan = Scan::new(recipe, memory).map_err(Failure::Scan)?;
    let kept = Kept::find(scan.recipe());
    for (index, reading) in kept.readings() {
        let _ = scan.record(*index, *reading); // a wrong one is read anew
    }
    Ok((scan, kept))
}

/// The main loop: one turn for each thing that the driver has to say.
fn run(board: &mut Board, mut driver: Driver<'static, Model>, mut kept: Option<Kept>) -> ! {
    let Board { uart, clock, meter } = board;
    loop {
        watchdog::feed();
        while let Some(byte) = uart.read() {
            driver.receive(byte);
        }
        let milliseconds = clock.pass();
        let action = match is_fitting(&driver) {
            true => meter.count(|| driver.poll(milliseconds)),
            false => driver.poll(milliseconds),
        };
        while let Some(byte) = driver.outgoing().first()
            && uart.write(*byte)
        {
            driver.sent(1);
        }
        match (action, &mut kept) {
            (Action::Wait { .. }, _) if driver.outgoing().is_empty() => {
                time::sleep(|| uart.has_byte());
            }
            (Action::Save { index, reading }, Some(kept)) => kept.insert(index, reading),
            (Action::Forget, Some(kept)) => kept.forget(),
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

/// Nothing in this firmware panics; if something does after all, it begins anew.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    reset()
}

/// A fault, such as a stack that overflows, begins anew too.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    reset()
}

fn reset() -> ! {
    SCB::sys_reset()
}
