//! Registers of the STM32F405. This file contains the unsafe access to hardware.
//!
//! Reference manual RM0090, sections 18.4 (timers) and 30.6 (USART).

/// A 32-bit register at a fixed address.
#[derive(Clone, Copy)]
pub struct Register(*mut u32);

impl Register {
    /// Reads the value.
    pub fn read(self) -> u32 {
        // SAFETY: `register` is only called with addresses of registers.
        unsafe { self.0.read_volatile() }
    }

    /// Writes a value.
    pub fn write(self, value: u32) {
        // SAFETY: `register` is only called with addresses of registers, and this write changes no memory.
        unsafe { self.0.write_volatile(value) }
    }
}

pub const TIM2: Timer = timer(0x4000_0000);
pub const TIM5: Timer = timer(0x4000_0C00);
pub const USART1_STATUS: Register = register(0x4001_1000);
pub const USART1_DATA: Register = register(0x4001_1004);
pub const USART1_CONTROL: Register = register(0x4001_100C);

/// A timer with a 32-bit counter.
#[derive(Clone, Copy)]
pub struct Timer {
    pub control: Register,
    pub event: Register,
    pub counter: Register,
    pub prescaler: Register,
    pub reload: Register,
}

const fn timer(address: usize) -> Timer {
    Timer {
        control: register(address),
        event: register(address + 0x14),
        counter: register(address + 0x24),
        prescaler: register(address + 0x28),
        reload: register(address + 0x2C),
    }
}

/// Returns the register at `address`. Only the constants above call this function, with registers of the STM32F405 or
/// of its core. None of them starts a DMA, so a write changes no memory of Rust's.
const fn register(address: usize) -> Register {
    Register(address as *mut u32)
}
