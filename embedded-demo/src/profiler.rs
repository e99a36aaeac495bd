//! Cost of a fit: instructions, and the peak depth of the stack.

#[path = "../bench/src/stack.rs"]
mod stack;

use crate::register::TIM5;
use crate::time;
pub use stack::paint as paint_stack;

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
        defmt::info!("stack_bytes={=usize}", stack::peak_bytes());
    }
}
