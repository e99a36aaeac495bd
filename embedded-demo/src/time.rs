//! Time in microseconds by a free-running timer, and sleep until an interrupt.
//!
//! TIM2 counts to 2^32 in hardware, so no time is lost while interrupts are masked, the fit runs, or a debugger reads a
//! log. SysTick only wakes a sleeping core. QEMU leaves out every second SysTick interrupt with `-icount sleep=off`,
//! which does no harm here.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::{asm, interrupt};
use cortex_m_rt::exception;

use crate::register::{TIM2, Timer};

/// Clock of the core, Hz.
const CORE_HZ: u32 = 168_000_000;
/// Nanoseconds per microsecond. QEMU's timers count nanoseconds.
const MICROSECOND: u32 = 1000;
/// Wake-ups of a sleeping core per second: enough to retransmit a request in time.
const WAKES_HZ: u32 = 100;

/// Clock of the time since the start.
pub struct Clock {
    /// Milliseconds at the last call of [`Clock::now_ms`].
    now_ms: u64,
    /// The timer's value at the last whole millisecond, us.
    last: u32,
}

impl Clock {
    /// Starts the clock at 0, and SysTick.
    pub fn start(mut systick: SYST) -> Self {
        start_free_running(TIM2, MICROSECOND);
        systick.set_clock_source(SystClkSource::Core);
        systick.set_reload(CORE_HZ / WAKES_HZ - 1);
        systick.clear_current();
        systick.enable_interrupt();
        systick.enable_counter();
        Self {
            now_ms: 0,
            last: microseconds(),
        }
    }

    /// Returns the milliseconds since the start. Call it at least once an hour, because the timer wraps around.
    pub fn now_ms(&mut self) -> u64 {
        let passed = microseconds().wrapping_sub(self.last) / 1000;
        self.last = self.last.wrapping_add(1000 * passed);
        self.now_ms += u64::from(passed);
        self.now_ms
    }
}

/// Sleeps until the next interrupt, at the latest that of SysTick. Returns at once if there is work.
pub fn sleep(has_work: impl Fn() -> bool) {
    // Interrupts are masked, so none is handled between the check and the sleep. A pending interrupt still wakes the
    // core, and is handled right after.
    interrupt::free(|_| {
        if !has_work() {
            asm::wfi();
        }
    });
}

/// Starts a timer that counts once in `divider` cycles of its clock, and never stops.
pub fn start_free_running(timer: Timer, divider: u32) {
    timer.prescaler.write(divider - 1);
    timer.reload.write(u32::MAX);
    timer.event.write(1); // loads the values above
    timer.control.write(1);
}

/// Returns the microseconds since the start. Wraps around after 71 minutes.
pub fn microseconds() -> u32 {
    TIM2.counter.read()
}

/// Wakes a sleeping core; there is nothing more to do.
#[exception]
fn SysTick() {}

defmt::timestamp!("{=u32:us}", microseconds());
