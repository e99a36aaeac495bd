//! A scanner's firmware: measures a material in a few directions and fits its BRDF.
//!
//! It runs unchanged on a board with an STM32F405 and on QEMU's netduinoplus2. Over the UART it
//! asks the scanner for each measurement and tells it the fitted parameters; see
//! `glimpse_core::link` for what is said. The README beside this folder says how to run, flash and
//! change it. All of a scan is in this file:
//!
//! 1. `main` reads the recipe, and scans one material after the other.
//! 2. `scan_material` greets the scanner, measures, fits, and tells the result.
//! 3. `take_over` goes on with a scan that a reset interrupted.
//!
//! Whatever fails is a `Failure` by name: it is logged, the scanner is told, and all begins anew.
//! Measurements outlast a host that falls silent as they outlast a reset.

#![no_std]
#![no_main]

mod board;
mod chip;
mod clocks;
mod interrupts;
mod kept;
mod link;
#[cfg(not(any(feature = "feather", feature = "nucleo")))]
mod log;
mod meter;
mod register;
mod ring;
mod time;
mod uart;
mod watchdog;

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
#[cfg(any(feature = "feather", feature = "nucleo"))]
use defmt_rtt as _; // the log, where a debug probe reads it
use glimpse_core::fit::Workspace;
use glimpse_core::link::{Failure, Refusal};
use glimpse_core::model::Neural;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use board::Board;
use kept::Kept;
use link::Link;
use meter::Meter;

/// What to measure and how to fit it, as the trainer wrote it. To train another, from the
/// repository's root:
/// `cargo run --release -- train --model neural --samples 8 --out embedded-demo/recipes/neural-n8.recipe`
static RECIPE: &[u8] = include_bytes!("../recipes/neural-n8.recipe");
/// The largest number of samples that a recipe may have here.
const CAPACITY: usize = 8;
/// Gradients in one slice of the fit: between two slices motors and watchdog have their turn.
const SLICE: usize = 8;
/// How often a measurement is taken before it is given up.
const MEASURE_ATTEMPTS: usize = 3;

#[entry]
fn main() -> ! {
    // Parameters and their gradient, 5.4 kB, and the scan. (`entry` makes them `&'static mut`.)
    static mut WORKSPACE: Workspace<Neural> = Workspace::new();

    static mut SCAN: Option<Scan<'static, Neural, CAPACITY>> = None;

    let Some(Board {
        uart,
        clock,
        mut meter,
    }) = board::start()
    else {
        reset(); // cannot be: it is started once
    };
    let mut link = Link::new(uart, clock);
    let scan = match begin(WORKSPACE, SCAN) {
        Ok(scan) => scan,
        Err(failure) => loop {
            // Nothing helps but another recipe; say so to whoever listens.
            defmt::error!("{}", failure);
            link.fail(failure);
        },
    };

    // The first scan may be one that a reset interrupted.
    let mut kept = Kept::find(scan.recipe());
    loop {
        let result = scan_material(scan, &mut link, &mut kept, &mut meter);
        if let Err(failure) = result {
            defmt::error!("{}", failure);
            link.fail(failure);
        }
        // A host that was away says itself, at the next hello, whether measurements hold still.
        let host_was_away =
            Err(Failure::NoReply) == result || Err(Failure::Refused(Refusal::NoScan)) == result;
        if !host_was_away {
            kept.forget();
        }
        scan.restart();
    }
}

/// Reads the recipe and begins a scan with it, in `place`. Out of line: what that takes of the stack
/// is given back before anything is measured.
#[inline(never)]
fn begin(
    workspace: &'static mut Workspace<Neural>,
    place: &'static mut Option<Scan<'static, Neural, CAPACITY>>,
) -> Result<&'static mut Scan<'static, Neural, CAPACITY>, Failure> {
    // Bits in flash may flip after the compiler has seen them, so it may not know them.
    let recipe = Recipe::parse(black_box(RECIPE)).map_err(Failure::Recipe)?;
    let scan = Scan::new(recipe, workspace).map_err(Failure::Scan)?;
    Ok(place.insert(scan))
}

/// Scans one material, from the first word to the last.
fn scan_material(
    scan: &mut Scan<Neural, CAPACITY>,
    link: &mut Link,
    kept: &mut Kept,
    meter: &mut Meter,
) -> Result<(), Failure> {
    link.hello(scan.recipe())?;
    defmt::info!("scan of {=usize} samples", scan.recipe().samples());
    take_over(scan, link, kept)?;

    // Measure where the recipe says. What cannot be a BRDF is measured once more.
    let mut attempts = 0;
    while let Some((index, directions)) = scan.next_directions() {
        let measurement = link.measure(index, directions)?;
        match scan.record(measurement) {
            Ok(()) => {
                attempts = 0;
                kept.add(measurement);
            }
            Err(error) => {
                defmt::warn!("measurement {=u16}: {}", index, error);
                attempts += 1;
                if attempts == MEASURE_ATTEMPTS {
                    return Err(Failure::Measurement { index, error });
                }
            }
        }
    }

    // Fit, slice by slice.
    meter.restart();
    loop {
        let progress = meter.count(|| scan.advance_fit(SLICE));
        link.progress(progress)?;
        if progress.is_complete() {
            break;
        }
    }

    // Tell the result.
    let residual = scan.residual();
    if !residual.mean.is_finite() {
        return Err(Failure::Diverged);
    }
    link.parameters(scan.parameters())?;
    link.finished(residual)?;
    defmt::info!("finished: {}", residual);
    meter.report();
    Ok(())
}

/// Takes over what was measured before a reset, if the scanner says that it holds still: the
/// material may have been changed meanwhile.
fn take_over(
    scan: &mut Scan<Neural, CAPACITY>,
    link: &mut Link,
    kept: &mut Kept,
) -> Result<(), Failure> {
    for (index, measurement) in (0..).zip(kept.measurements()) {
        if !link.holds(index, *measurement)? || scan.record(*measurement).is_err() {
            defmt::warn!("all is measured anew");
            scan.restart();
            kept.forget();
            return Ok(());
        }
    }
    defmt::info!("{=usize} were measured before", kept.measurements().len());
    Ok(())
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
