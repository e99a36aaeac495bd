//! A UART that never waits.
//!
//! An interrupt puts each received byte into a [`Queue`], so none is lost during a step of the fit. Its priority is the
//! highest, because the next byte overwrites this one after 87 us. SysTick, the only other interrupt, may be late.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::{NVIC, SCB};
use cortex_m_rt::exception;
use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer, Queue};

use crate::register::{USART1_CONTROL, USART1_DATA, USART1_STATUS};

const INTERRUPT: u16 = 37;
/// The lowest priority.
const SYSTICK_PRIORITY: u8 = 0xF0;

/// Status bit: at least one byte was lost, because the previous one was not read in time.
const OVERRUN: u32 = 1 << 3;
/// Status bit: a byte was received.
const RECEIVED: u32 = 1 << 5;
/// Status bit: the transmitter is ready.
const READY: u32 = 1 << 7;
/// Control bits: USART on, interrupt for each received byte, transmitter on, receiver on.
const ENABLE: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

/// Capacity of the queue plus one: the bytes of 22 ms at 115,200 baud.
const QUEUE_BYTES: usize = 256;

/// The interrupt handler's end of the queue. None until the UART is started.
static PRODUCER: Mutex<Cell<Option<Producer<'static, u8>>>> = Mutex::new(Cell::new(None));
/// Number of bytes lost because the queue was full or the interrupt was late.
static LOST_BYTES: AtomicU32 = AtomicU32::new(0);

/// The number of the UART's interrupt.
#[derive(Clone, Copy)]
struct Received;

// SAFETY: the number is constant, and the chip has this interrupt.
unsafe impl InterruptNumber for Received {
    fn number(self) -> u16 {
        INTERRUPT
    }
}

/// The UART of the scanner. A singleton.
pub struct Uart {
    bytes: Consumer<'static, u8>,
    /// Number of lost bytes already reported.
    reported: u32,
}

impl Uart {
    /// Starts the UART. Returns None if it is already started.
    pub fn start(nvic: &mut NVIC, scb: &mut SCB) -> Option<Self> {
        let queue = cortex_m::singleton!(: Queue<u8, QUEUE_BYTES> = Queue::new())?;
        let (producer, bytes) = queue.split();
        critical_section::with(|section| PRODUCER.borrow(section).set(Some(producer)));
        USART1_CONTROL.write(ENABLE);
        // SAFETY: no critical section relies on priorities; all of them mask every interrupt.
        unsafe {
            nvic.set_priority(Received, 0);
            scb.set_priority(SystemHandler::SysTick, SYSTICK_PRIORITY);
        }
        // SAFETY: the handler exists, and shares only atomics and the ends of a queue with the main loop.
        unsafe { NVIC::unmask(Received) };
        Some(Self { bytes, reported: 0 })
    }

    /// Returns the next received byte, if there is one.
    pub fn read(&mut self) -> Option<u8> {
        let lost = LOST_BYTES.load(Ordering::Relaxed);
        if lost != self.reported {
            defmt::warn!("the UART has lost {=u32} bytes", lost);
            self.reported = lost;
        }
        self.bytes.dequeue()
    }

    /// Sends a byte. Returns false if the transmitter is busy.
    pub fn write(&mut self, byte: u8) -> bool {
        let ready = USART1_STATUS.read() & READY != 0;
        if ready {
            USART1_DATA.write(byte.into());
        }
        ready
    }

    /// Returns true if a byte was received.
    pub fn has_byte(&self) -> bool {
        self.bytes.ready()
    }
}

/// Adds a byte to the queue; called by the interrupt handler. Returns false if the queue is full.
fn enqueue(byte: u8) -> bool {
    critical_section::with(|section| {
        let end = PRODUCER.borrow(section);
        let mut producer = end.take();
        let added = producer
            .as_mut()
            .is_some_and(|producer| producer.enqueue(byte).is_ok());
        end.set(producer);
        added
    })
}

/// Handles the UART's interrupt: reads the received byte.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    if number != INTERRUPT as i16 {
        SCB::sys_reset() // no other interrupt is enabled
    }
    let status = USART1_STATUS.read();
    if status & (RECEIVED | OVERRUN) == 0 {
        return;
    }
    // Reading the data after the status also clears an overrun, which would block the receiver.
    let byte = USART1_DATA.read() as u8;
    let overrun = status & OVERRUN != 0;
    let dropped = status & RECEIVED != 0 && !enqueue(byte);
    let lost = u32::from(overrun) + u32::from(dropped);
    // No other code writes this counter, so a separate load and store are enough.
    LOST_BYTES.store(
        LOST_BYTES.load(Ordering::Relaxed).wrapping_add(lost),
        Ordering::Relaxed,
    );
}
