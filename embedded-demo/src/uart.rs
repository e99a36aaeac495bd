//! A USART of the STM32F4. Neither reading nor writing ever waits.
//!
//! An interrupt puts each byte that comes into a [`Ring`], so that none is lost while a slice of
//! the fit runs.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::register::Usart;
use crate::ring::Ring;

/// Status: overrun, received, ready to transmit.
const OVERRUN: u32 = 1 << 3;
const RECEIVED: u32 = 1 << 5;
const READY: u32 = 1 << 7;
/// Control: enable, interrupt when received, transmitter on, receiver on.
const ENABLE: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

static BYTES: Ring = Ring::new();
/// Bytes that came when there was no room, or that the interrupt was too late for.
static LOST: AtomicU32 = AtomicU32::new(0);

/// The UART that leads to the scanner: 8 bits, no parity, one stop bit. There is one.
pub struct Uart {
    usart: Usart,
    /// How many lost bytes were told.
    told: u32,
}

impl Uart {
    /// Turns it on; `clock_hz` is its clock, `baud` its speed in bits a second.
    pub fn start(usart: Usart, clock_hz: u32, baud: u32) -> Self {
        usart.baud.write(divider(clock_hz, baud));
        usart.control.write(ENABLE);
        Self { usart, told: 0 }
    }

    /// The next byte, if one has come.
    pub fn read(&mut self) -> Option<u8> {
        let lost = LOST.load(Ordering::Relaxed);
        if lost != self.told {
            defmt::warn!("the UART has lost {=u32} bytes so far", lost);
            self.told = lost;
        }
        BYTES.pop()
    }

    /// Sends a byte; false if the one before is still on its way.
    pub fn write(&mut self, byte: u8) -> bool {
        let ready = self.usart.status.read() & READY != 0;
        if ready {
            self.usart.data.write(byte.into());
        }
        ready
    }

    /// True if a byte has come.
    pub fn has_byte(&self) -> bool {
        !BYTES.is_empty()
    }
}

/// The nearest divider of a clock for a speed.
pub const fn divider(clock_hz: u32, baud: u32) -> u32 {
    (clock_hz + baud / 2) / baud
}

/// Takes the byte that has come. For the interrupt's handler.
pub fn receive(usart: Usart) {
    let status = usart.status.read();
    if status & (RECEIVED | OVERRUN) == 0 {
        return;
    }
    // Reading the data after the status also ends an overrun, which would block receiving.
    let byte = usart.data.read() as u8;
    let overrun = status & OVERRUN != 0;
    let dropped = status & RECEIVED != 0 && !BYTES.push(byte);
    let lost = u32::from(overrun) + u32::from(dropped);
    // No other handler writes it: to load and to store is enough.
    LOST.store(
        LOST.load(Ordering::Relaxed).wrapping_add(lost),
        Ordering::Relaxed,
    );
}
