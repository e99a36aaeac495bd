//! Peak depth of the stack.

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
