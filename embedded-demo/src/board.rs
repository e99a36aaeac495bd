//! The board, from reset to the main loop.
//!
//! Any board with an STM32F405 will do: it runs on the internal oscillator, so crystals do not
//! matter. [`WIRING`] says which pins lead to the scanner, at 115,200 baud, 8N1.

use cortex_m::Peripherals;

use crate::chip::ResetCause;
use crate::clocks::{self, Clocks};
use crate::meter::Meter;
use crate::register::{Port, RCC_AHB1ENR};
use crate::time::Clock;
use crate::uart::{self, Uart};
use crate::wiring::{WIRING, Wiring};
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
    let uart = Uart::start(WIRING.usart, bus.start(clocks), BAUD)?;
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
