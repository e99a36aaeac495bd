//! Logs: defmt over semihosting, where somebody takes them; else silence.
//!
//! A semihosting call is a breakpoint. QEMU and debuggers serve it; on a board by itself it
//! would be a fault, so it is left out there. (Features that name a board log by RTT instead.)
//!
//! Interrupts are masked while a line is written, so that whoever logs, and from wherever, has the
//! line to himself. In QEMU no time passes meanwhile; a debugger halts the core anyway.

use core::cell::UnsafeCell;

use cortex_m::peripheral::DCB;
use cortex_m_semihosting::hio::{HostStream, hstdout};
use critical_section::RestoreState;
use heapless::Vec;

use crate::chip;

/// True if somebody takes semihosting calls. Without, they are faults.
fn has_semihosting() -> bool {
    DCB::is_debugger_attached() || chip::is_emulated()
}

/// Collects a line, so that it costs one semihosting call.
struct Line {
    encoder: defmt::Encoder,
    bytes: Vec<u8, 128>,
    output: Option<HostStream>,
    /// Whether interrupts were masked before the line began.
    masked_before: RestoreState,
}

impl Line {
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
        if self.output.is_none() && has_semihosting() {
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
        let _ = line.push(*byte); // there is room
    }
}

fn flush(line: &mut Vec<u8, 128>, output: &mut Option<HostStream>) {
    // The debugger may have gone since the last line.
    if let Some(output) = output
        && has_semihosting()
    {
        let _ = output.write_all(line);
    }
    line.clear();
}

struct Logger {
    line: UnsafeCell<Line>,
}

// SAFETY: defmt's calls come in the order acquire, write, release. There is one core, and from
// acquire to release its interrupts are masked, so the line has one user at a time.
unsafe impl Sync for Logger {}

static LOGGER: Logger = Logger {
    line: UnsafeCell::new(Line {
        encoder: defmt::Encoder::new(),
        bytes: Vec::new(),
        output: None,
        masked_before: RestoreState::invalid(),
    }),
};

impl Logger {
    fn with_line(&self, act: impl FnOnce(&mut Line)) {
        // SAFETY: one user at a time, see `Sync`; the reference ends with `act`, which cannot
        // come back here.
        act(unsafe { &mut *self.line.get() });
    }
}

#[defmt::global_logger]
struct Defmt;

// SAFETY: from acquire to release interrupts are masked, so that nobody else acquires it.
unsafe impl defmt::Logger for Defmt {
    fn acquire() {
        // SAFETY: `release` follows, and gives back this very state.
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
        // SAFETY: `acquire` has left it there.
        unsafe { critical_section::release(masked_before) };
    }
}
