//! The board: which pins lead to the scanner. For another board change this file.
//!
//! Any board with an STM32F405 will do: it runs on the internal oscillator, so crystals do not
//! matter. [`WIRING`] says which pins lead to the scanner, at 115,200 baud, 8N1.

use cortex_m::Peripherals;

use crate::chip::ResetCause;
use crate::clocks::{self, Clocks};
use crate::meter::Meter;
use crate::register::{
    GPIOA, GPIOB, Port, RCC_AHB1ENR, RCC_APB1ENR, RCC_APB2ENR, USART1, USART2, USART3, Usart,
};
use crate::time::Clock;
use crate::uart::{self, Uart};
use crate::{interrupts, watchdog};

/// The UART's speed in bits a second.
const BAUD: u32 = 115_200;

/// At each clock that a UART may have its speed is right within a fifth of a percent; both ends
/// together may be off by 3 %.
const _: () = assert!(
    is_right(Clocks::Pll.apb1_hz())
        && is_right(Clocks::Pll.apb2_hz())
        && is_right(Clocks::Oscillator.apb1_hz())
);

const fn is_right(clock_hz: u32) -> bool {
    let real = uart::divider(clock_hz, BAUD) * BAUD;
    real.abs_diff(clock_hz) <= clock_hz / 500
}

/// The UART that leads to the scanner.
pub const WIRING: Wiring = if cfg!(feature = "feather") {
    // Adafruit Feather STM32F405 Express: its pins TX and RX.
    Wiring {
        usart: USART3,
        interrupt: 39,
        bus: Bus::Apb1 { clock: 1 << 18 },
        port: GPIOB,
        transmit: 10,
        receive: 11,
    }
} else if cfg!(feature = "nucleo") {
    // Nucleo-64 with an STM32F446: its ST-LINK makes a serial port of it on the USB cable.
    Wiring {
        usart: USART2,
        interrupt: 38,
        bus: Bus::Apb1 { clock: 1 << 17 },
        port: GPIOA,
        transmit: 2,
        receive: 3,
    }
} else {
    // QEMU's netduinoplus2, and whatever board leads these pins out.
    Wiring {
        usart: USART1,
        interrupt: 37,
        bus: Bus::Apb2 { clock: 1 << 4 },
        port: GPIOA,
        transmit: 9,
        receive: 10,
    }
};

/// A USART, and the pins that it is led out to; their alternate function is 7.
pub struct Wiring {
    pub usart: Usart,
    pub interrupt: u16,
    bus: Bus,
    port: Port,
    transmit: u32,
    receive: u32,
}

/// The bus that a USART is on, and the bit that turns on its clock there.
#[allow(dead_code)] // a board has its UART on one of them
enum Bus {
    Apb1 { clock: u32 },
    Apb2 { clock: u32 },
}

impl Bus {
    /// Turns the USART's clock on, and returns it in Hz.
    fn start(&self, clocks: Clocks) -> u32 {
        match self {
            Self::Apb1 { clock } => {
                clocks::turn_on(RCC_APB1ENR, *clock);
                clocks.apb1_hz()
            }
            Self::Apb2 { clock } => {
                clocks::turn_on(RCC_APB2ENR, *clock);
                clocks.apb2_hz()
            }
        }
    }
}

/// What a firmware works with.
pub struct Board {
    /// The line to the scanner.
    pub uart: Uart,
    /// Time.
    pub clock: Clock,
    /// What a fit costs.
    pub meter: Meter,
}

/// Starts watchdog, clocks, time, pins, UART and interrupts, and says why it had to. None if it has been started
/// already.
pub fn start() -> Option<Board> {
    let mut core = Peripherals::take()?;
    watchdog::start();
    let cause = ResetCause::take();
    let clocks = Clocks::start();

    let Wiring { port, bus, .. } = WIRING;
    clocks::turn_on(RCC_AHB1ENR, port.clock);
    lead_out(port, WIRING.transmit);
    lead_out(port, WIRING.receive);
    let uart = Uart::start(WIRING.usart, bus.start(clocks), BAUD);
    let meter = Meter::start(clocks);
    let clock = Clock::start(clocks, core.SYST);
    interrupts::start(&mut core.NVIC, &mut core.SCB);

    defmt::info!("reset: {}", cause);
    clocks.report();
    Some(Board { uart, clock, meter })
}

/// Gives a pin to the USART. Pulled up, so that no cable is silence.
fn lead_out(port: Port, pin: u32) {
    let (functions, place) = match pin.checked_sub(8) {
        None => (port.low_functions, pin),
        Some(place) => (port.high_functions, place),
    };
    functions.modify(0b1111 << (4 * place), 7 << (4 * place));
    port.pull.modify(0b11 << (2 * pin), 0b01 << (2 * pin));
    port.mode.modify(0b11 << (2 * pin), 0b10 << (2 * pin));
}
