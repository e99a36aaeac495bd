//! A USART of the STM32F4 that never waits.
//!
//! An interrupt puts each received byte into a [`Queue`], so none is lost during a step of the fit.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer, Queue};

use crate::register::Usart;

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

/// The UART of the scanner: 8 bits, no parity, one stop bit. A singleton.
pub struct Uart {
    usart: Usart,
    bytes: Consumer<'static, u8>,
    /// Number of lost bytes already reported.
    reported: u32,
}

impl Uart {
    /// Starts the UART. `clock_hz` is its clock, `baud` its speed in bit/s. Returns None if it is already started.
    pub fn start(usart: Usart, clock_hz: u32, baud: u32) -> Option<Self> {
        let queue = cortex_m::singleton!(: Queue<u8, QUEUE_BYTES> = Queue::new())?;
        let (producer, bytes) = queue.split();
        critical_section::with(|section| PRODUCER.borrow(section).set(Some(producer)));
        usart.baud.write(divider(clock_hz, baud));
        usart.control.write(ENABLE);
        Some(Self {
            usart,
            bytes,
            reported: 0,
        })
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
        let ready = self.usart.status.read() & READY != 0;
        if ready {
            self.usart.data.write(byte.into());
        }
        ready
    }

    /// Returns true if a byte was received.
    pub fn has_byte(&self) -> bool {
        self.bytes.ready()
    }
}

/// Returns the divider of the clock whose result is nearest to a baud rate.
pub const fn divider(clock_hz: u32, baud: u32) -> u32 {
    (clock_hz + baud / 2) / baud
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

/// Reads the received byte; called by the interrupt handler.
pub fn receive(usart: Usart) {
    let status = usart.status.read();
    if status & (RECEIVED | OVERRUN) == 0 {
        return;
    }
    // Reading the data after the status also clears an overrun, which would block the receiver.
    let byte = usart.data.read() as u8;
    let overrun = status & OVERRUN != 0;
    let dropped = status & RECEIVED != 0 && !enqueue(byte);
    let lost = u32::from(overrun) + u32::from(dropped);
    // No other code writes this counter, so a separate load and store are enough.
    LOST_BYTES.store(
        LOST_BYTES.load(Ordering::Relaxed).wrapping_add(lost),
        Ordering::Relaxed,
    );
}
