//! Instruction counter for each machine, and the peak depth of the stack.

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

/// Peak depth of the stack.
pub mod stack {
    const PAINT: u32 = 0xA5A5_5A5A;

    unsafe extern "C" {
        static mut _stack_end: u32;
        static _stack_start: u32;
    }

    /// Paints the stack below the caller's frame.
    #[inline(never)]
    pub fn paint() {
        let here = 0_u32;
        // Below this function's frame with some margin. The stack grows downwards.
        let top = (&raw const here).wrapping_sub(32);
        let mut word = &raw mut _stack_end;
        while word.cast_const() < top {
            // SAFETY: between the linker script's end of the stack and this address below the stack pointer there is
            // aligned, unused RAM.
            unsafe { word.write_volatile(PAINT) };
            word = word.wrapping_add(1);
        }
    }

    /// Returns the peak size of the stack since [`paint`], in bytes.
    #[must_use]
    pub fn peak_bytes() -> usize {
        let mut word = &raw const _stack_end;
        let start = &raw const _stack_start;
        // SAFETY: the whole stack is aligned RAM. Below the stack pointer there is paint or old values.
        while word < start && unsafe { word.read_volatile() } == PAINT {
            word = word.wrapping_add(1);
        }
        start.addr() - word.addr()
    }
}

/// Returns the only reference to a static.
///
/// # Safety
/// `pointer` points to a static, and no other reference to it ever exists.
pub unsafe fn unique_static<T>(pointer: *mut T) -> &'static mut T {
    // SAFETY: guaranteed by the caller.
    unsafe { &mut *pointer }
}
