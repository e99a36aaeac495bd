//! Time: microseconds by a timer that runs freely, and sleep that ends in time.
//!
//! TIM2 counts to 2^32 without anybody's help, so no time is lost while interrupts are masked, the
//! fit runs, or a debugger takes a log. SysTick only wakes a core that sleeps, so it does no harm
//! that QEMU leaves out every second of its interrupts with `-icount sleep=off`.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::{asm, interrupt};
use cortex_m_rt::exception;

use crate::clocks::{self, Clocks};
use crate::register::{RCC_APB1ENR, TIM2, Timer};

const MICROSECONDS_HZ: u32 = 1_000_000;
const _: () = assert!(
    Clocks::Pll.timer_hz().is_multiple_of(MICROSECONDS_HZ)
        && Clocks::Oscillator
            .timer_hz()
            .is_multiple_of(MICROSECONDS_HZ)
);
/// How often a sleeping core is woken in a second: often enough to send a request again in time.
const WAKES_HZ: u32 = 100;

/// Time that passes.
pub struct Clock {
    /// Until when [`Clock::pass`] has told all, in microseconds.
    told: u32,
}

impl Clock {
    /// Starts at zero, and SysTick with it.
    pub fn start(clocks: Clocks, mut systick: SYST) -> Self {
        run_freely(TIM2, clocks.timer_hz() / MICROSECONDS_HZ);
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(clocks.core_hz() / WAKES_HZ - 1);
        systick.clear_current();
        systick.enable_interrupt();
        systick.enable_counter();
        let told = microseconds();
        Self { told }
    }

    /// Milliseconds that have passed since this was asked last (which may not be an hour ago). What
    /// is not a whole one yet is told the next time.
    pub fn pass(&mut self) -> u32 {
        let passed = microseconds().wrapping_sub(self.told) / 1000;
        self.told = self.told.wrapping_add(1000 * passed);
        passed
    }
}

/// Sleeps until there is an interrupt: SysTick's comes soon. Does not sleep if there is something to
/// do already.
pub fn sleep(has_work: impl Fn() -> bool) {
    // Masked, so that nothing can come between the look and the sleep. An interrupt wakes the core
    // all the same, and is handled right after.
    interrupt::free(|_| {
        if !has_work() {
            asm::wfi();
        }
    });
}

/// Has a timer count from now on, once in so many of its clock's cycles, and never stop.
pub fn run_freely(timer: Timer, divider: u32) {
    clocks::turn_on(RCC_APB1ENR, timer.clock);
    timer.prescaler.write(divider - 1);
    timer.reload.write(u32::MAX);
    timer.event.write(1); // takes over what was written
    timer.control.write(1);
}

/// Microseconds since the start; wraps around after 71 minutes.
pub fn microseconds() -> u32 {
    TIM2.counter.read()
}

/// A sleeping core wakes at each interrupt, and that is all that this one is for.
#[exception]
fn SysTick() {}

defmt::timestamp!("{=u32:us}", microseconds());
