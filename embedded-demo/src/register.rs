//! Peripheral registers. What is unsafe about hardware is in this file.

/// A 32-bit register at a fixed address.
#[derive(Clone, Copy)]
pub struct Register(*mut u32);

impl Register {
    /// The register at `address`.
    ///
    /// # Safety
    /// A register must be there, and no value written to it by this firmware may change memory
    /// that Rust knows of (no DMA).
    pub const unsafe fn at(address: usize) -> Self {
        Self(address as *mut u32)
    }

    /// Its value.
    pub fn read(self) -> u32 {
        // SAFETY: by `at` there is a register here.
        unsafe { self.0.read_volatile() }
    }

    /// Changes its value.
    pub fn write(self, value: u32) {
        // SAFETY: by `at` there is a register here, and writing to it leaves memory alone.
        unsafe { self.0.write_volatile(value) }
    }

    /// Changes the bits of `mask` to those of `value`.
    pub fn modify(self, mask: u32, value: u32) {
        self.write(self.read() & !mask | value);
    }
}
