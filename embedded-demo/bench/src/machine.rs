//! What differs between machines, the counter of instructions, and what does not: stack and statics.

/// Instructions since some time, for differences of less than a minute; QEMU runs with
/// `-icount shift=0`, where each takes a nanosecond.
#[cfg(target_arch = "arm")]
pub mod counter {
    use cortex_m::Peripherals;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;

    /// Ticks of SysTick in a second of the machine that QEMU plays: of microbit and of
    /// netduinoplus2.
    const HZ: u64 = if cfg!(target_feature = "v7") {
        168_000_000
    } else {
        16_000_000
    };
    const MASK: u32 = (1 << 24) - 1;

    /// Starts it.
    pub fn start() {
        if let Some(core) = Peripherals::take() {
            let mut systick = core.SYST;
            systick.set_clock_source(SystClkSource::Core);
            systick.set_reload(MASK);
            systick.clear_current();
            systick.enable_counter();
        }
    }

    /// Now. Out of line: in a trace of all instructions its address tells where a fit begins and
    /// ends.
    #[inline(never)]
    #[must_use]
    pub fn now() -> u32 {
        SYST::get_current()
    }

    /// Instructions from one time to another.
    #[must_use]
    pub fn between(before: u32, after: u32) -> u32 {
        let ticks = before.wrapping_sub(after) & MASK; // it counts down
        (u64::from(ticks) * 1_000_000_000 / HZ) as u32
    }
}

/// See the other one.
#[cfg(target_arch = "riscv32")]
pub mod counter {
    use riscv::register::minstret;

    /// It runs.
    pub fn start() {}

    /// Now.
    #[must_use]
    pub fn now() -> u32 {
        minstret::read() as u32
    }

    /// Instructions from one time to another.
    #[must_use]
    pub fn between(before: u32, after: u32) -> u32 {
        after.wrapping_sub(before)
    }
}

/// How deep the stack was.
pub mod stack {
    const PAINT: u32 = 0xA5A5_5A5A;

    unsafe extern "C" {
        static mut _stack_end: u32;
        static _stack_start: u32;
    }

    /// Paints what lies below the caller's frame.
    #[inline(never)]
    pub fn paint() {
        let here = 0_u32;
        // Below this function's frame, with room to spare; the stack grows downwards.
        let top = (&raw const here).wrapping_sub(32);
        let mut word = &raw mut _stack_end;
        while word.cast_const() < top {
            // SAFETY: from the linker script's end of the stack up to below the stack pointer there
            // is aligned RAM, and nobody's.
            unsafe { word.write_volatile(PAINT) };
            word = word.wrapping_add(1);
        }
    }

    /// The largest number of bytes that the stack had since.
    #[must_use]
    pub fn bytes() -> usize {
        let mut word = &raw const _stack_end;
        let start = &raw const _stack_start;
        // SAFETY: the whole stack is aligned RAM; below the stack pointer lies paint or what was
        // left there.
        while word < start && unsafe { word.read_volatile() } == PAINT {
            word = word.wrapping_add(1);
        }
        start.addr() - word.addr()
    }
}

/// A static's only reference.
///
/// # Safety
/// `place` is a static, and there is no other reference to it, now or later.
pub unsafe fn only<T>(place: *mut T) -> &'static mut T {
    // SAFETY: by the caller's word.
    unsafe { &mut *place }
}
