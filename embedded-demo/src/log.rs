//! Log: defmt over semihosting.
//!
//! Interrupts are masked while a line is written, so each line has one writer. In QEMU no time passes meanwhile.

use cortex_m_semihosting::hio::{HostStream, hstdout};
use critical_section::RestoreState;
use heapless::Vec;

/// A buffered log line, which takes one semihosting call.
struct Line {
    bytes: Vec<u8, 128>,
    output: Option<HostStream>,
}

impl Line {
    fn append(&mut self, encoded: &[u8]) {
        for byte in encoded {
            if self.bytes.is_full() {
                self.flush();
            }
            let _ = self.bytes.push(*byte); // never full here
        }
    }

    fn flush(&mut self) {
        if let Some(output) = &mut self.output {
            let _ = output.write_all(&self.bytes);
        }
        self.bytes.clear();
    }
}

struct Logger {
    encoder: defmt::Encoder,
    line: Line,
    /// State of the interrupt mask before the line began.
    masked_before: RestoreState,
}

static mut LOGGER: Logger = Logger {
    encoder: defmt::Encoder::new(),
    line: Line {
        bytes: Vec::new(),
        output: None,
    },
    masked_before: RestoreState::invalid(),
};

/// Returns the logger.
///
/// # Safety
/// Interrupts are masked, and no other reference to the logger is used.
unsafe fn logger() -> &'static mut Logger {
    let logger = &raw mut LOGGER;
    // SAFETY: guaranteed by the caller.
    unsafe { &mut *logger }
}

#[defmt::global_logger]
struct Defmt;

// SAFETY: defmt calls acquire, write, release in this order. The only core masks interrupts from acquire to release, so
// the logger has one user at a time.
unsafe impl defmt::Logger for Defmt {
    fn acquire() {
        // SAFETY: `release` follows and restores this state. Until then the logger has one user.
        let (masked_before, logger) = unsafe { (critical_section::acquire(), logger()) };
        logger.masked_before = masked_before;
        if logger.line.output.is_none() {
            logger.line.output = hstdout().ok();
        }
        logger
            .encoder
            .start_frame(|bytes| logger.line.append(bytes));
    }

    unsafe fn flush() {}

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: between acquire and release the logger has one user.
        let logger = unsafe { logger() };
        logger
            .encoder
            .write(bytes, |bytes| logger.line.append(bytes));
    }

    unsafe fn release() {
        // SAFETY: as above.
        let logger = unsafe { logger() };
        logger.encoder.end_frame(|bytes| logger.line.append(bytes));
        logger.line.flush();
        // SAFETY: `acquire` stored this state.
        unsafe { critical_section::release(logger.masked_before) };
    }
}
