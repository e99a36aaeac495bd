//! Registers of the STM32F405. This file contains the unsafe access to hardware.
//!
//! Reference manual RM0090, sections 3.9 (flash), 7.3 (clocks), 8.4 (pins), 18.4 (timers), 21.4 (watchdog), 30.6
//! (USART), 38.6 (debug).

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

    /// Changes the bits of `mask` to those of `value`.
    pub fn modify(self, mask: u32, value: u32) {
        self.write(self.read() & !mask | value);
    }
}

pub const FLASH_ACR: Register = register(0x4002_3C00);
pub const RCC_CR: Register = register(0x4002_3800);
pub const RCC_PLLCFGR: Register = register(0x4002_3804);
pub const RCC_CFGR: Register = register(0x4002_3808);
pub const RCC_AHB1ENR: Register = register(0x4002_3830);
pub const RCC_APB1ENR: Register = register(0x4002_3840);
pub const RCC_APB2ENR: Register = register(0x4002_3844);
pub const RCC_CSR: Register = register(0x4002_3874);
pub const IWDG_KR: Register = register(0x4000_3000);
pub const IWDG_PR: Register = register(0x4000_3004);
pub const IWDG_RLR: Register = register(0x4000_3008);
pub const DBGMCU_IDCODE: Register = register(0xE004_2000);
pub const DBGMCU_APB1_FZ: Register = register(0xE004_2008);
pub const ROM_TABLE_CIDR0: Register = register(0xE00F_FFF0);

pub const GPIOA: Port = port(0, 0x4002_0000);
pub const GPIOB: Port = port(1, 0x4002_0400);
pub const TIM2: Timer = timer(0, 0x4000_0000);
pub const TIM5: Timer = timer(3, 0x4000_0C00);
pub const USART1: Usart = usart(0x4001_1000);
pub const USART2: Usart = usart(0x4000_4400);
pub const USART3: Usart = usart(0x4000_4800);

/// A GPIO port of sixteen pins.
#[derive(Clone, Copy)]
pub struct Port {
    /// Bit of the port's clock in AHB1ENR.
    pub clock: u32,
    pub mode: Register,
    pub pull: Register,
    /// Alternate functions of pins 0 to 7, and of 8 to 15.
    pub low_functions: Register,
    pub high_functions: Register,
}

/// A timer with a 32-bit counter.
#[derive(Clone, Copy)]
pub struct Timer {
    /// Bit of the timer's clock in APB1ENR.
    pub clock: u32,
    pub control: Register,
    pub event: Register,
    pub counter: Register,
    pub prescaler: Register,
    pub reload: Register,
}

/// A serial port.
#[derive(Clone, Copy)]
pub struct Usart {
    pub status: Register,
    pub data: Register,
    pub baud: Register,
    pub control: Register,
}

const fn port(index: u32, address: usize) -> Port {
    Port {
        clock: 1 << index,
        mode: register(address),
        pull: register(address + 0x0C),
        low_functions: register(address + 0x20),
        high_functions: register(address + 0x24),
    }
}

const fn timer(index: u32, address: usize) -> Timer {
    Timer {
        clock: 1 << index,
        control: register(address),
        event: register(address + 0x14),
        counter: register(address + 0x24),
        prescaler: register(address + 0x28),
        reload: register(address + 0x2C),
    }
}

const fn usart(address: usize) -> Usart {
    Usart {
        status: register(address),
        data: register(address + 0x04),
        baud: register(address + 0x08),
        control: register(address + 0x0C),
    }
}

/// Returns the register at `address`. Only the constants above call this function, with registers of the STM32F405 or
/// of its core. None of them starts a DMA, so a write changes no memory of Rust's.
const fn register(address: usize) -> Register {
    Register(address as *mut u32)
}
