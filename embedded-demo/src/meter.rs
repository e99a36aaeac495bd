//! What a fit costs: the core's cycles, and the depth of the stack.

use cortex_m_rt::STACK_PAINT_VALUE;

use crate::clocks::Clocks;
use crate::register::TIM5;
use crate::time;

/// Counts the cycles of what it is given, by TIM5, which counts each tick of the timers' clock.
pub struct Meter {
    clocks: Clocks,
    ticks: u32,
}

impl Meter {
    /// Nothing was counted yet.
    pub fn start(clocks: Clocks) -> Self {
        time::run_freely(TIM5, 1);
        Self { clocks, ticks: 0 }
    }

    /// Forgets what was counted.
    pub fn restart(&mut self) {
        self.ticks = 0;
    }

    /// Does it and counts what it takes, interrupts on the way included. It may take 4 s in an
    /// emulator, and 51 s on a chip.
    pub fn count<T>(&mut self, act: impl FnOnce() -> T) -> T {
        let begun = TIM5.counter.read();
        let result = act();
        let ticks = TIM5.counter.read().wrapping_sub(begun);
        self.ticks = self.ticks.wrapping_add(ticks);
        result
    }

    /// Logs what was counted, as `name=value` lines, and begins anew.
    pub fn report(&mut self) {
        let ticks = core::mem::take(&mut self.ticks);
        match self.clocks {
            // QEMU with `-icount shift=0`: an instruction takes a nanosecond, whatever it is.
            Clocks::Emulator => defmt::info!("fit_instructions={=u32}", ticks),
            clocks => {
                let cycles = u64::from(ticks) * u64::from(clocks.core_hz())
                    / u64::from(clocks.timer_hz().max(1));
                defmt::info!("fit_cycles={=u64}", cycles);
            }
        }
        defmt::info!("stack_bytes={=usize}", stack_bytes());
    }
}

/// The largest number of bytes that the stack ever had.
fn stack_bytes() -> usize {
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
