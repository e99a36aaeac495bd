//! Which interrupts there are, how urgent they are, and who handles them.
//!
//! | interrupt | priority | handler |
//! |---|---|---|
//! | the UART's | 0, the most urgent: the next byte overwrites this one after 87 us | puts the byte into a queue |
//! | SysTick | 0xF0, the least urgent | none: it wakes the core, and may be late |
//!
//! Everything else is the main loop's. Handlers neither log nor feed the watchdog. The main loop
//! masks interrupts where it looks before it sleeps, and for the time of a log line.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::{NVIC, SCB};
use cortex_m_rt::exception;

use crate::uart;
use crate::wiring::WIRING;

const UART_PRIORITY: u8 = 0;
const SYSTICK_PRIORITY: u8 = 0xF0;

/// The number of the UART's interrupt.
#[derive(Clone, Copy)]
struct Uart;

// SAFETY: it always gives the same number, of an interrupt that the chip has.
unsafe impl InterruptNumber for Uart {
    fn number(self) -> u16 {
        WIRING.interrupt
    }
}

/// Lets interrupts come, once what they need is there.
pub fn start(nvic: &mut NVIC, scb: &mut SCB) {
    // SAFETY: no critical section relies on priorities; all of them mask every interrupt.
    unsafe {
        nvic.set_priority(Uart, UART_PRIORITY);
        scb.set_priority(SystemHandler::SysTick, SYSTICK_PRIORITY);
    }
    // SAFETY: its handler is there, and shares with the main loop only atomics and the ends of a queue.
    unsafe { NVIC::unmask(Uart) };
}

/// Takes every interrupt: which one is the UART's differs from board to board.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    if number == WIRING.interrupt as i16 {
        uart::receive(WIRING.usart);
    } else {
        SCB::sys_reset() // no other one is on
    }
}
