//! The board: clocks and pins. For another board change this file.
//!
//! Any board with an STM32F405 will do: it runs on the internal oscillator (1 % off at room
//! temperature, which a UART bears), so crystals do not matter. [`WIRING`] says which pins lead to
//! the scanner, at 115,200 baud, 8N1.

use cortex_m::{Peripherals, interrupt};

use crate::meter;
use crate::register::Register;
use crate::uart::{Interrupt, Uart};

/// The core's clock in Hz, which SysTick counts.
pub const CORE_HZ: u32 = 168_000_000;
/// The UART's speed in bits a second.
const BAUD: u32 = 115_200;

/// The UART that leads to the scanner.
const WIRING: Wiring = if cfg!(feature = "feather") {
    // Adafruit Feather STM32F405 Express: its pins TX and RX.
    Wiring {
        usart: 0x4000_4800, // USART3
        interrupt: 39,
        clock: (RCC_APB1ENR, 1 << 18),
        clock_divider: 4,
        port: GPIOB,
        transmit: 10,
        receive: 11,
    }
} else if cfg!(feature = "nucleo") {
    // Nucleo-64 with an STM32F446: its ST-LINK makes a serial port of it on the USB cable.
    Wiring {
        usart: 0x4000_4400, // USART2
        interrupt: 38,
        clock: (RCC_APB1ENR, 1 << 17),
        clock_divider: 4,
        port: GPIOA,
        transmit: 2,
        receive: 3,
    }
} else {
    // QEMU's netduinoplus2, and whatever board leads these pins out.
    Wiring {
        usart: 0x4001_1000, // USART1
        interrupt: 37,
        clock: (RCC_APB2ENR, 1 << 4),
        clock_divider: 2,
        port: GPIOA,
        transmit: 9,
        receive: 10,
    }
};

/// A USART, and the pins that it is led out to; their alternate function is 7.
struct Wiring {
    usart: usize,
    interrupt: u16,
    /// Where its clock is turned on, and by which bit.
    clock: (Register, u32),
    /// The core's clock by its own.
    clock_divider: u32,
    port: Port,
    transmit: u32,
    receive: u32,
}

/// A port of sixteen pins.
struct Port {
    /// Bit of its clock in AHB1ENR.
    clock: u32,
    mode: Register,
    pull: Register,
    /// Alternate functions of pins 0 to 7, and of 8 to 15.
    low_functions: Register,
    high_functions: Register,
}

impl Port {
    /// Gives a pin to the USART. Pulled up, so that no cable is silence.
    fn lead_out(&self, pin: u32) {
        let (functions, place) = match pin.checked_sub(8) {
            None => (self.low_functions, pin),
            Some(place) => (self.high_functions, place),
        };
        functions.modify(0b1111 << (4 * place), 7 << (4 * place));
        self.pull.modify(0b11 << (2 * pin), 0b01 << (2 * pin));
        self.mode.modify(0b11 << (2 * pin), 0b10 << (2 * pin));
    }
}

/// Polls for an oscillator before going on without it; it takes 0.3 ms.
const PATIENCE: u32 = 100_000;

/// Reference manual RM0090, sections 3.9 (flash), 7.3 (clocks), 8.4 (pins), 21.4 (watchdog),
/// 30.6 (USART), 38.6 (debug).
mod address {
    use super::{Port, Register};

    pub const FLASH_ACR: Register = register(0x4002_3C00);
    pub const RCC_CR: Register = register(0x4002_3800);
    pub const RCC_PLLCFGR: Register = register(0x4002_3804);
    pub const RCC_CFGR: Register = register(0x4002_3808);
    pub const RCC_AHB1ENR: Register = register(0x4002_3830);
    pub const RCC_APB1ENR: Register = register(0x4002_3840);
    pub const RCC_APB2ENR: Register = register(0x4002_3844);
    pub const GPIOA: Port = port(0, 0x4002_0000);
    pub const GPIOB: Port = port(1, 0x4002_0400);
    pub const IWDG_KR: Register = register(0x4000_3000);
    pub const IWDG_PR: Register = register(0x4000_3004);
    pub const IWDG_RLR: Register = register(0x4000_3008);
    pub const DBGMCU_IDCODE: Register = register(0xE004_2000);
    pub const DBGMCU_APB1_FZ: Register = register(0xE004_2008);
    pub const ROM_TABLE_CIDR0: Register = register(0xE00F_FFF0);

    const fn port(index: u32, address: usize) -> Port {
        Port {
            clock: 1 << index,
            mode: register(address),
            pull: register(address + 0x0C),
            low_functions: register(address + 0x20),
            high_functions: register(address + 0x24),
        }
    }

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

    let Wiring {
        usart, interrupt, ..
    } = WIRING;
    RCC_AHB1ENR.modify(0, WIRING.port.clock);
    let (clock, bit) = WIRING.clock;
    clock.modify(0, bit);
    WIRING.port.lead_out(WIRING.transmit);
    WIRING.port.lead_out(WIRING.receive);
    // SAFETY: such a USART is there, nothing else uses it, and interrupts are masked.
    unsafe { Uart::new(usart, Interrupt(interrupt), uart_hz / BAUD) }
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

/// Runs the core at 168 MHz, and returns the clock of the USART in Hz.
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
    CORE_HZ / WIRING.clock_divider
}

/// True in an emulator, which has neither an identity of the chip nor CoreSight's ROM table.
pub fn is_emulated() -> bool {
    DBGMCU_IDCODE.read() == 0 && ROM_TABLE_CIDR0.read() == 0
}
