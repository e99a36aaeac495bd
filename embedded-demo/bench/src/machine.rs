//! Entry point and instruction counter for each machine.

#[cfg(target_arch = "arm")]
pub use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
pub use riscv_rt::entry;

/// Instruction counter for intervals below 2^24 ticks of SysTick: 0.1 s at 168 MHz, 0.8 s at 20 MHz. QEMU runs with
/// `-icount shift=0`, where each instruction takes a nanosecond.
#[cfg(target_arch = "arm")]
pub mod counter {
    use cortex_m::Peripherals;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;

    /// SysTick frequency of QEMU's machines: netduinoplus2, mps2-an505, or microbit.
    const HZ: u64 = if cfg!(chip = "stm32f405") {
        168_000_000
    } else if cfg!(chip = "mps2-an505") {
        20_000_000
    } else {
        16_000_000
    };
    const MASK: u32 = (1 << 24) - 1;

    /// Starts the counter.
    pub fn start() {
        if let Some(core) = Peripherals::take() {
            let mut systick = core.SYST;
            systick.set_clock_source(SystClkSource::Core);
            systick.set_reload(MASK);
            systick.clear_current();
            systick.enable_counter();
        }
    }

    /// Returns the present count. Not inlined: its address marks the start and the end of a fit in an
    /// instruction trace.
    #[inline(never)]
    #[must_use]
    pub fn now() -> u32 {
        SYST::get_current()
    }

    /// Returns the instructions between two counts.
    #[must_use]
    pub fn between(before: u32, after: u32) -> u32 {
        let ticks = before.wrapping_sub(after) & MASK; // SysTick counts down
        (u64::from(ticks) * 1_000_000_000 / HZ) as u32
    }
}

/// Instruction counter for intervals below 2^32 instructions.
#[cfg(target_arch = "riscv32")]
pub mod counter {
    use riscv::register::minstret;

    /// Does nothing: the counter always runs.
    pub fn start() {}

    /// Returns the present count.
    #[must_use]
    pub fn now() -> u32 {
        minstret::read() as u32
    }

    /// Returns the instructions between two counts.
    #[must_use]
    pub fn between(before: u32, after: u32) -> u32 {
        after.wrapping_sub(before)
    }
}
