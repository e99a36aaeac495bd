//! The clocks: 168 MHz by the PLL from the internal oscillator, or 16 MHz if it does not lock.
//!
//! The internal oscillator is 1 % off at room temperature, which a UART bears, so a board's
//! crystal does not matter.

use crate::chip;
use crate::register::{FLASH_ACR, RCC_CFGR, RCC_CR, RCC_PLLCFGR, Register};

/// Polls for an oscillator before going on without it: at least 25 ms, and it takes 0.3 ms.
const PATIENCE: u32 = 100_000;

/// What drives the core and its peripherals.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Clocks {
    /// The PLL, as it should be.
    Pll,
    /// The PLL did not lock; the internal oscillator, ten times slower. All times hold still.
    Oscillator,
    /// QEMU, which has no clocks to set. Its timers count nanoseconds.
    Emulator,
}

impl Clocks {
    /// Sets the clocks.
    pub fn start() -> Self {
        FLASH_ACR.write(0b111 << 8 | 5); // both caches, prefetch, five wait states
        // Internal oscillator 16 MHz / 8 * 168 / 2; the rest of the register is reserved.
        RCC_PLLCFGR.modify(0x0F43_7FFF, 7 << 24 | 168 << 6 | 8);
        RCC_CR.modify(0, 1 << 24);
        if !comes(|| RCC_CR.read() & 1 << 25 != 0) {
            return if chip::is_emulated() {
                Self::Emulator
            } else {
                Self::Oscillator
            };
        }
        RCC_CFGR.write(0b100 << 13 | 0b101 << 10); // APB2 by 2, APB1 by 4
        RCC_CFGR.modify(0b11, 0b10); // the core on the PLL
        if comes(|| RCC_CFGR.read() & 0b1100 == 0b1000) {
            return Self::Pll;
        }
        RCC_CFGR.write(0); // as after a reset: nothing is divided
        Self::Oscillator
    }

    /// The core's clock in Hz.
    pub const fn core_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 168_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// The clock of peripherals on APB1 in Hz.
    pub const fn apb1_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 42_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// The clock of peripherals on APB2 in Hz.
    pub const fn apb2_hz(self) -> u32 {
        match self {
            Self::Pll | Self::Emulator => 84_000_000,
            Self::Oscillator => 16_000_000,
        }
    }

    /// The clock of timers on APB1 in Hz: twice that bus's, if it is a divided one.
    pub const fn timer_hz(self) -> u32 {
        match self {
            Self::Pll => 84_000_000,
            Self::Oscillator => 16_000_000,
            Self::Emulator => 1_000_000_000,
        }
    }

    /// Says what the clocks are.
    pub fn report(self) {
        match self {
            Self::Pll => defmt::info!("clock: 168 MHz"),
            Self::Oscillator => defmt::error!("clock: the PLL does not lock; 16 MHz"),
            Self::Emulator => defmt::info!("clock: an emulator's"),
        }
    }
}

/// Turns on the clock of a peripheral by its bit in one of RCC's registers.
pub fn turn_on(register: Register, bit: u32) {
    register.modify(0, bit);
    register.read(); // by then the clock runs (the errata sheet asks for this delay)
}

/// Waits for an oscillator, but not for ever.
fn comes(is_there: impl Fn() -> bool) -> bool {
    (0..PATIENCE).any(|_| is_there())
}
