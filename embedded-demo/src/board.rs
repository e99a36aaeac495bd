//! Initialization of the board, from reset to the main loop.
//!
//! The firmware runs on any board with an STM32F405, because it uses the internal oscillator instead of a crystal.
//! [`WIRING`] defines the pins of the UART. Its format is 115,200 baud, 8N1.

use cortex_m::Peripherals;

use crate::chip::ResetCause;
use crate::clocks::{self, Clocks};
use crate::profiler::Profiler;
use crate::register::{Port, RCC_AHB1ENR};
use crate::time::Clock;
use crate::uart::{self, Uart};
use crate::wiring::{WIRING, Wiring};
use crate::{interrupts, watchdog};

/// Baud rate of the UART, bit/s.
const BAUD: u32 = 115_200;

/// The baud rate is within 0.2 % at every possible clock. A UART tolerates 3 % in total for both ends.
const _: () = assert!(
    is_accurate(Clocks::Pll.apb1_hz())
        && is_accurate(Clocks::Pll.apb2_hz())
        && is_accurate(Clocks::Oscillator.apb1_hz())
);

const fn is_accurate(clock_hz: u32) -> bool {
    // The clock at which this divider results in exactly the baud rate.
    let exact_hz = uart::divider(clock_hz, BAUD) * BAUD;
    exact_hz.abs_diff(clock_hz) <= clock_hz / 500
}

/// The board's peripherals.
pub struct Board {
    /// Serial line to the scanner.
    pub uart: Uart,
    /// Time since the start.
    pub clock: Clock,
    /// Counter of the fit's cycles.
    pub profiler: Profiler,
}

/// Starts watchdog, clocks, timers, pins, UART and interrupts, and logs the reset cause. Returns None if called again.
pub fn start() -> Option<Board> {
    let mut core = Peripherals::take()?;
    watchdog::start();
    let cause = ResetCause::take();
    let clocks = Clocks::start();

    let Wiring { port, bus, .. } = WIRING;
    clocks::enable_clock(RCC_AHB1ENR, port.clock);
    connect_pin(port, WIRING.transmit);
    connect_pin(port, WIRING.receive);
    let uart = Uart::start(WIRING.usart, bus.start(clocks), BAUD)?;
    let profiler = Profiler::start(clocks);
    let clock = Clock::start(clocks, core.SYST);
    interrupts::start(&mut core.NVIC, &mut core.SCB);

    defmt::info!("reset: {}", cause);
    clocks.report();
    Some(Board {
        uart,
        clock,
        profiler,
    })
}

/// Connects a pin to the USART. Its pull-up keeps a disconnected line idle.
fn connect_pin(port: Port, pin: u32) {
    const ALTERNATE_FUNCTION: u32 = 7; // USART1 to USART3
    // Each register has the alternate functions of eight pins.
    let (functions, index) = match pin.checked_sub(8) {
        None => (port.low_functions, pin),
        Some(index) => (port.high_functions, index),
    };
    functions.modify(0b1111 << (4 * index), ALTERNATE_FUNCTION << (4 * index));
    port.pull.modify(0b11 << (2 * pin), 0b01 << (2 * pin));
    port.mode.modify(0b11 << (2 * pin), 0b10 << (2 * pin));
}
