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

/// Time since the start.
pub struct Clock {
    /// Milliseconds at the last call of [`Clock::now_ms`].
    now_ms: u64,
    /// The timer's microseconds at the last whole millisecond.
    last: u32,
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
        Self {
            now_ms: 0,
            last: microseconds(),
        }
    }

    /// Returns the milliseconds since the start. It is called at least once an hour, since the timer wraps around.
    pub fn now_ms(&mut self) -> u64 {
        let passed = microseconds().wrapping_sub(self.last) / 1000;
        self.last = self.last.wrapping_add(1000 * passed);
        self.now_ms += u64::from(passed);
        self.now_ms
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
