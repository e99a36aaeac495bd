//! The board: clocks and pins. For another board change this file.
//!
//! Any board with an STM32F405 will do: it runs on the internal oscillator (1 % off at room
//! temperature, which a UART bears), so crystals do not matter. USART1 is on PA9 (transmit) and PA10 (receive), 115,200 baud, 8N1.

use cortex_m::peripheral::DCB;
use cortex_m::{Peripherals, interrupt};

use crate::meter;
use crate::register::Register;
use crate::uart::{Interrupt, Uart};

/// The core's clock in Hz, which SysTick counts.
pub const CORE_HZ: u32 = 168_000_000;
/// The UART's speed in bits a second.
const BAUD: u32 = 115_200;

/// Polls for an oscillator before going on without it; it takes 0.3 ms.
const PATIENCE: u32 = 100_000;

/// Reference manual RM0090, sections 3.9 (flash), 7.3 (clocks), 8.4 (pins), 21.4 (watchdog),
/// 30.6 (USART), 38.6 (debug).
mod address {
    use super::Register;

    pub const FLASH_ACR: Register = register(0x4002_3C00);
    pub const RCC_CR: Register = register(0x4002_3800);
    pub const RCC_PLLCFGR: Register = register(0x4002_3804);
    pub const RCC_CFGR: Register = register(0x4002_3808);
    pub const RCC_AHB1ENR: Register = register(0x4002_3830);
    pub const RCC_APB2ENR: Register = register(0x4002_3844);
    pub const GPIOA_MODER: Register = register(0x4002_0000);
    pub const GPIOA_PUPDR: Register = register(0x4002_000C);
    pub const GPIOA_AFRH: Register = register(0x4002_0024);
    pub const IWDG_KR: Register = register(0x4000_3000);
    pub const IWDG_PR: Register = register(0x4000_3004);
    pub const IWDG_RLR: Register = register(0x4000_3008);
    pub const DBGMCU_IDCODE: Register = register(0xE004_2000);
    pub const DBGMCU_APB1_FZ: Register = register(0xE004_2008);
    pub const ROM_TABLE_CIDR0: Register = register(0xE00F_FFF0);
    pub const USART1: usize = 0x4001_1000;
    pub const USART1_INTERRUPT: u16 = 37;

    const fn register(address: usize) -> Register {
        // SAFETY: only the constants above call it, all of them registers of the STM32F405 (or,
        // the last, of its core), and none of them starts a DMA.
        unsafe { Register::at(address) }
    }
}
use address::*;

/// Starts watchdog, clocks, pins and SysTick, and returns the UART.
pub fn start() -> Uart {
    interrupt::disable(); // for good: interrupts wake the core, and that is all they do
    start_watchdog();
    let uart_hz = start_clocks();
    if let Some(core) = Peripherals::take() {
        meter::start(core.SYST);
    }

    RCC_AHB1ENR.modify(0, 1); // GPIOA
    RCC_APB2ENR.modify(0, 1 << 4); // USART1
    GPIOA_AFRH.modify(0xFF << 4, 0x77 << 4); // PA9, PA10: alternate function 7
    GPIOA_PUPDR.modify(0b11 << 20, 0b01 << 20); // PA10: pulled up, so that no cable is silence
    GPIOA_MODER.modify(0b1111 << 18, 0b1010 << 18);
    // SAFETY: USART1 is there, nothing else uses it, and interrupts are masked.
    unsafe { Uart::new(USART1, Interrupt(USART1_INTERRUPT), uart_hz / BAUD) }
}

/// Resets the chip unless [`feed_watchdog`] is called at least every 4 s (32 kHz / 32 / 4096).
fn start_watchdog() {
    DBGMCU_APB1_FZ.modify(0, 1 << 12); // not while a debugger halts the core
    IWDG_KR.write(0xCCCC);
    IWDG_KR.write(0x5555);
    IWDG_PR.write(3);
    IWDG_RLR.write(0xFFF);
    feed_watchdog();
}

/// The firmware is alive.
pub fn feed_watchdog() {
    IWDG_KR.write(0xAAAA);
}

/// Runs the core at 168 MHz and USART1 at 84 MHz. Returns the latter in Hz.
fn start_clocks() -> u32 {
    FLASH_ACR.write(0b111 << 8 | 5); // both caches, prefetch, five wait states
    // Internal oscillator 16 MHz / 8 * 168 / 2; the rest of the register is reserved.
    RCC_PLLCFGR.modify(0x0F43_7FFF, 7 << 24 | 168 << 6 | 8);
    RCC_CR.modify(0, 1 << 24);
    let locked = (0..PATIENCE).any(|_| RCC_CR.read() & 1 << 25 != 0);
    if !locked {
        return 16_000_000; // QEMU has no clocks to set
    }
    RCC_CFGR.write(0b100 << 13 | 0b101 << 10); // APB2 by 2, APB1 by 4
    RCC_CFGR.modify(0b11, 0b10); // the core on the PLL
    CORE_HZ / 2
}

/// True in an emulator, which has neither an identity of the chip nor CoreSight's ROM table.
pub fn is_emulated() -> bool {
    DBGMCU_IDCODE.read() == 0 && ROM_TABLE_CIDR0.read() == 0
}

/// True if somebody takes semihosting calls. Without, they are faults.
pub fn has_semihosting() -> bool {
    DCB::is_debugger_attached() || is_emulated()
}
