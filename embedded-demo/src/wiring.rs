//! Pins of the scanner's UART. Change this file for another board.

use crate::clocks::{self, Clocks};
use crate::register::{
    GPIOA, GPIOB, Port, RCC_APB1ENR, RCC_APB2ENR, USART1, USART2, USART3, Usart,
};

/// The UART of the scanner.
pub const WIRING: Wiring = if cfg!(feature = "feather") {
    // Adafruit Feather STM32F405 Express: pins TX and RX.
    Wiring {
        usart: USART3,
        interrupt: 39,
        bus: Bus::Apb1 { clock: 1 << 18 },
        port: GPIOB,
        transmit: 10,
        receive: 11,
    }
} else if cfg!(feature = "nucleo") {
    // Nucleo-64 with an STM32F446: its ST-LINK provides this UART as a serial port over USB.
    Wiring {
        usart: USART2,
        interrupt: 38,
        bus: Bus::Apb1 { clock: 1 << 17 },
        port: GPIOA,
        transmit: 2,
        receive: 3,
    }
} else {
    // QEMU's netduinoplus2, and any board with these pins on a header.
    Wiring {
        usart: USART1,
        interrupt: 37,
        bus: Bus::Apb2 { clock: 1 << 4 },
        port: GPIOA,
        transmit: 9,
        receive: 10,
    }
};

/// A USART and its pins, with alternate function 7.
pub struct Wiring {
    pub usart: Usart,
    pub interrupt: u16,
    pub bus: Bus,
    pub port: Port,
    pub transmit: u32,
    pub receive: u32,
}

/// The bus of a USART, and the bit that enables its clock there.
#[allow(dead_code)] // each board uses one of them
pub enum Bus {
    Apb1 { clock: u32 },
    Apb2 { clock: u32 },
}

impl Bus {
    /// Enables the USART's clock, and returns it in Hz.
    pub fn start(&self, clocks: Clocks) -> u32 {
        match self {
            Self::Apb1 { clock } => {
                clocks::enable_clock(RCC_APB1ENR, *clock);
                clocks.apb1_hz()
            }
            Self::Apb2 { clock } => {
                clocks::enable_clock(RCC_APB2ENR, *clock);
                clocks.apb2_hz()
            }
        }
    }
}
