//! Interrupts, their priorities and handlers.
//!
//! | interrupt | priority | handler |
//! |---|---|---|
//! | UART | 0, the highest: the next byte overwrites this one after 87 us | puts the byte into a queue |
//! | SysTick | 0xF0, the lowest | empty: it wakes the core, and may be late |
//!
//! The main loop does everything else. Handlers neither log nor feed the watchdog. The main loop masks interrupts
//! between its last check and sleep, and while it logs a line.

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

// SAFETY: the number is constant, and the chip has this interrupt.
unsafe impl InterruptNumber for Uart {
    fn number(self) -> u16 {
        WIRING.interrupt
    }
}

/// Enables the interrupts. The UART must be started before.
pub fn start(nvic: &mut NVIC, scb: &mut SCB) {
    // SAFETY: no critical section relies on priorities; all of them mask every interrupt.
    unsafe {
        nvic.set_priority(Uart, UART_PRIORITY);
        scb.set_priority(SystemHandler::SysTick, SYSTICK_PRIORITY);
    }
    // SAFETY: the handler exists, and shares only atomics and the ends of a queue with the main loop.
    unsafe { NVIC::unmask(Uart) };
}

/// Handles every interrupt, because the number of the UART's interrupt depends on the board.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    if number == WIRING.interrupt as i16 {
        uart::receive(WIRING.usart);
    } else {
        SCB::sys_reset() // no other interrupt is enabled
    }
}
