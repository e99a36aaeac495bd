//! A USART of the STM32F4. Neither reading nor writing ever waits.
//!
//! An interrupt puts each byte that comes into a [`Queue`], so that none is lost while a slice of
//! the fit runs.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer, Queue};

use crate::register::Usart;

/// Status: overrun, received, ready to transmit.
const OVERRUN: u32 = 1 << 3;
const RECEIVED: u32 = 1 << 5;
const READY: u32 = 1 << 7;
/// Control: enable, interrupt when received, transmitter on, receiver on.
const ENABLE: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

/// Places of the queue, of which one stays free: room for the bytes of 22 ms at 115,200 baud.
const PLACES: usize = 256;

/// The interrupt's end of the queue, once the UART is on.
static BYTES: Mutex<Cell<Option<Producer<'static, u8>>>> = Mutex::new(Cell::new(None));
/// Bytes that came when there was no room, or that the interrupt was too late for.
static LOST: AtomicU32 = AtomicU32::new(0);

/// The UART that leads to the scanner: 8 bits, no parity, one stop bit. There is one.
pub struct Uart {
    usart: Usart,
    bytes: Consumer<'static, u8>,
    /// How many lost bytes were reported.
    reported: u32,
}

impl Uart {
    /// Turns it on; `clock_hz` is its clock, `baud` its speed in bits a second. None if it is on already.
    pub fn start(usart: Usart, clock_hz: u32, baud: u32) -> Option<Self> {
        let queue = cortex_m::singleton!(: Queue<u8, PLACES> = Queue::new())?;
        let (producer, bytes) = queue.split();
        critical_section::with(|section| BYTES.borrow(section).set(Some(producer)));
        usart.baud.write(divider(clock_hz, baud));
        usart.control.write(ENABLE);
        Some(Self {
            usart,
            bytes,
            reported: 0,
        })
    }

    /// The next byte, if one has come.
    pub fn read(&mut self) -> Option<u8> {
        let lost = LOST.load(Ordering::Relaxed);
        if lost != self.reported {
            defmt::warn!("the UART has lost {=u32} bytes so far", lost);
            self.reported = lost;
        }
        self.bytes.dequeue()
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
        self.bytes.ready()
    }
}

/// The nearest divider of a clock for a speed.
pub const fn divider(clock_hz: u32, baud: u32) -> u32 {
    (clock_hz + baud / 2) / baud
}

/// Adds a byte to the queue; false if it has no room. For the interrupt's handler.
fn enqueue(byte: u8) -> bool {
    critical_section::with(|section| {
        let end = BYTES.borrow(section);
        let mut producer = end.take();
        let added = producer
            .as_mut()
            .is_some_and(|producer| producer.enqueue(byte).is_ok());
        end.set(producer);
        added
    })
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
    let dropped = status & RECEIVED != 0 && !enqueue(byte);
    let lost = u32::from(overrun) + u32::from(dropped);
    // No other handler writes it: to load and to store is enough.
    LOST.store(
        LOST.load(Ordering::Relaxed).wrapping_add(lost),
        Ordering::Relaxed,
    );
}
