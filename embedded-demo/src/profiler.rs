//! Cost of a fit: instructions, and the peak depth of the stack.

use cortex_m_rt::STACK_PAINT_VALUE;

use crate::register::TIM5;
use crate::time;

/// Counts the instructions of functions: with `-icount shift=0` each takes a nanosecond, and TIM5 counts them.
pub struct Profiler {
    ticks: u32,
}

impl Profiler {
    /// Starts the timer; the count is 0.
    pub fn start() -> Self {
        time::start_free_running(TIM5, 1);
        Self { ticks: 0 }
    }

    /// Resets the count to 0.
    pub fn restart(&mut self) {
        self.ticks = 0;
    }

    /// Calls a function and counts its duration, interrupts included. A call may take at most 4 s.
    pub fn measure<T>(&mut self, act: impl FnOnce() -> T) -> T {
        let start = TIM5.counter.read();
        let result = act();
        let ticks = TIM5.counter.read().wrapping_sub(start);
        self.ticks = self.ticks.wrapping_add(ticks);
        result
    }

    /// Logs the count and the stack as `name=value` lines, and resets the count.
    pub fn report(&mut self) {
        let ticks = core::mem::take(&mut self.ticks);
        defmt::info!("fit_instructions={=u32}", ticks);
        defmt::info!("stack_bytes={=usize}", stack_bytes());
    }
}

/// Returns the peak size of the stack since the start, in bytes.
fn stack_bytes() -> usize {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let end = &raw const _stack_end;
    let start = &raw const _stack_start;
    let mut word = end;
    // SAFETY: the stack lies between these symbols of the linker script, aligned and in RAM. The words below the stack
    // pointer are paint or old values, never the target of a reference.
    while word < start && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    start.addr() - word.addr()
}
