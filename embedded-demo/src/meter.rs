//! Time by SysTick, and the depth of the stack.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::STACK_PAINT_VALUE;

use crate::board::{self, CORE_HZ};

/// SysTick comes round every 2^22 ticks: 25 ms at 168 MHz.
const TICKS_MASK: u32 = (1 << 22) - 1;

/// Starts SysTick: a tick for each cycle of the core, and an interrupt each time it comes round.
pub fn start(mut systick: SYST) {
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(TICKS_MASK);
    systick.clear_current();
    systick.enable_interrupt();
    systick.enable_counter();
}

/// Counts ticks of the core's clock. It has to be read at least once in 25 ms.
pub struct Stopwatch {
    last: u32,
    ticks: u32,
}

impl Stopwatch {
    /// From now on.
    pub fn start() -> Self {
        Self {
            last: SYST::get_current(),
            ticks: 0,
        }
    }

    /// Ticks since the start; wraps around after 25 s.
    pub fn ticks(&mut self) -> u32 {
        // SysTick counts down.
        let now = SYST::get_current();
        self.ticks = self
            .ticks
            .wrapping_add(self.last.wrapping_sub(now) & TICKS_MASK);
        self.last = now;
        self.ticks
    }
}

/// The largest number of bytes that the stack ever had.
pub fn stack_bytes() -> usize {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let end = &raw const _stack_end;
    let start = &raw const _stack_start;
    let mut word = end;
    // SAFETY: between the linker script's symbols is the stack, aligned and in RAM; what lies
    // below the stack pointer is paint or old values, never a reference's target.
    while word < start && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    start.addr() - word.addr()
}

/// Logs what a fit of `ticks` cost, as `name=value` lines.
pub fn report(ticks: u32) {
    if board::is_emulated() {
        // QEMU with `-icount shift=0`: an instruction takes a nanosecond, whatever it is.
        let instructions = u64::from(ticks) * 1_000_000_000 / u64::from(CORE_HZ);
        defmt::info!("fit_instructions={=u64}", instructions);
    } else {
        defmt::info!("fit_cycles={=u32}", ticks);
    }
    defmt::info!("stack_bytes={=usize}", stack_bytes());
}
