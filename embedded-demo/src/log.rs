//! Log: defmt over semihosting.
//!
//! Interrupts are masked while a line is written, so each line has one writer. In QEMU no time passes meanwhile.

use core::cell::UnsafeCell;

use cortex_m_semihosting::hio::{HostStream, hstdout};
use critical_section::RestoreState;
use heapless::Vec;

/// A buffered log line, which takes one semihosting call.
struct LineBuffer {
    encoder: defmt::Encoder,
    bytes: Vec<u8, 128>,
    output: Option<HostStream>,
    /// State of the interrupt mask before the line began.
    masked_before: RestoreState,
}

impl LineBuffer {
    fn write(&mut self, bytes: &[u8]) {
        let Self {
            encoder,
            bytes: line,
            output,
            ..
        } = self;
        encoder.write(bytes, |encoded| append(line, output, encoded));
    }

    fn start(&mut self) {
        if self.output.is_none() {
            self.output = hstdout().ok();
        }
        let Self {
            encoder,
            bytes: line,
            output,
            ..
        } = self;
        encoder.start_frame(|encoded| append(line, output, encoded));
    }

    fn end(&mut self) {
        let Self {
            encoder,
            bytes: line,
            output,
            ..
        } = self;
        encoder.end_frame(|encoded| append(line, output, encoded));
        flush(line, output);
    }
}

fn append(line: &mut Vec<u8, 128>, output: &mut Option<HostStream>, encoded: &[u8]) {
    for byte in encoded {
        if line.is_full() {
            flush(line, output);
        }
        let _ = line.push(*byte); // never full here
    }
}

fn flush(line: &mut Vec<u8, 128>, output: &mut Option<HostStream>) {
    if let Some(output) = output {
        let _ = output.write_all(line);
    }
    line.clear();
}

struct Logger {
    line: UnsafeCell<LineBuffer>,
}

// SAFETY: defmt calls acquire, write, release in this order. The only core masks interrupts from acquire to release, so
// the line has one user at a time.
unsafe impl Sync for Logger {}

static LOGGER: Logger = Logger {
    line: UnsafeCell::new(LineBuffer {
        encoder: defmt::Encoder::new(),
        bytes: Vec::new(),
        output: None,
        masked_before: RestoreState::invalid(),
    }),
};

impl Logger {
    fn with_line(&self, act: impl FnOnce(&mut LineBuffer)) {
        // SAFETY: one user at a time, see `Sync`. The reference ends with `act`, which cannot call this function.
        act(unsafe { &mut *self.line.get() });
    }
}

#[defmt::global_logger]
struct Defmt;

// SAFETY: from acquire to release interrupts are masked, so no other code acquires it.
unsafe impl defmt::Logger for Defmt {
    fn acquire() {
        // SAFETY: `release` follows and restores this state.
        let masked_before = unsafe { critical_section::acquire() };
        LOGGER.with_line(|line| {
            line.masked_before = masked_before;
            line.start();
        });
    }

    unsafe fn flush() {}

    unsafe fn write(bytes: &[u8]) {
        LOGGER.with_line(|line| line.write(bytes));
    }

    unsafe fn release() {
        let mut masked_before = RestoreState::invalid();
        LOGGER.with_line(|line| {
            line.end();
            masked_before = line.masked_before;
        });
        // SAFETY: `acquire` stored this state.
        unsafe { critical_section::release(masked_before) };
    }
}
