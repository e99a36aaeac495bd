//! A USART of the STM32F4. Neither reading nor writing ever waits.

use cortex_m::asm;
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::{NVIC, SCB};

use crate::register::Register;

/// Status: overrun, received, ready to transmit.
const OVERRUN: u32 = 1 << 3;
const RECEIVED: u32 = 1 << 5;
const READY: u32 = 1 << 7;
/// Control: enable, interrupt when received, transmitter on, receiver on.
const ENABLE: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

/// The number of a USART's interrupt.
#[derive(Clone, Copy)]
pub struct Interrupt(pub u16);

// SAFETY: it always gives the same number.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self.0
    }
}

/// A UART: 8 bits, no parity, one stop bit.
pub struct Uart {
    status: Register,
    data: Register,
    interrupt: Interrupt,
}

impl Uart {
    /// Turns on the USART at `base`; `divider` is its clock divided by the baud rate.
    ///
    /// # Safety
    /// An STM32F4's USART with this interrupt must be there, its clock on, and nothing else may
    /// use it. Interrupts must be masked for good: they only wake the core.
    pub unsafe fn new(base: usize, interrupt: Interrupt, divider: u32) -> Self {
        // SAFETY: the registers of a USART, by the caller; DMA stays off.
        let at = |offset| unsafe { Register::at(base + offset) };
        at(0x08).write(divider);
        at(0x0C).write(ENABLE);
        // SAFETY: no critical section relies on it, and its handler never runs.
        unsafe { NVIC::unmask(interrupt) };
        Self {
            status: at(0x00),
            data: at(0x04),
            interrupt,
        }
    }

    /// The next byte, if one has come.
    pub fn read(&mut self) -> Option<u8> {
        // Reading the data after the status also ends an overrun, which would block receiving.
        self.has_byte().then(|| self.data.read() as u8)
    }

    /// Sleeps until a byte has come, or at the latest until SysTick comes round.
    pub fn wait(&mut self) {
        // Interrupts are masked: pending, they wake the core and nothing more.
        NVIC::unpend(self.interrupt);
        SCB::clear_pendst();
        if !self.has_byte() {
            asm::wfi();
        }
    }

    fn has_byte(&self) -> bool {
        self.status.read() & (RECEIVED | OVERRUN) != 0
    }

    /// Sends a byte; false if the one before is still on its way.
    pub fn write(&mut self, byte: u8) -> bool {
        let ready = self.status.read() & READY != 0;
        if ready {
            self.data.write(byte.into());
        }
        ready
    }
}
