//! Bytes on their way from an interrupt handler to the main loop.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

/// Room for bytes: those of 22 ms at 115,200 baud.
const SIZE: usize = 256;

/// A queue with one writer and one reader, neither of which ever waits.
pub struct Ring {
    bytes: [AtomicU8; SIZE],
    /// How many were ever written and read; the difference waits.
    written: AtomicUsize,
    read: AtomicUsize,
}

impl Ring {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            bytes: [const { AtomicU8::new(0) }; SIZE],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
        }
    }

    /// Adds a byte; false if there is no room. For the writer alone.
    pub fn push(&self, byte: u8) -> bool {
        let written = self.written.load(Ordering::Relaxed);
        // Acquire: the reader has taken what lay here before it says so.
        let waiting = written.wrapping_sub(self.read.load(Ordering::Acquire));
        if let Some(place) = self.bytes.get(written % SIZE)
            && waiting < SIZE
        {
            place.store(byte, Ordering::Relaxed);
            // Release: the byte is there before it is counted.
            self.written
                .store(written.wrapping_add(1), Ordering::Release);
            return true;
        }
        false
    }

    /// Takes the oldest byte. For the reader alone.
    pub fn pop(&self) -> Option<u8> {
        let read = self.read.load(Ordering::Relaxed);
        if self.is_empty() {
            return None;
        }
        let byte = self.bytes.get(read % SIZE)?.load(Ordering::Relaxed);
        self.read.store(read.wrapping_add(1), Ordering::Release);
        Some(byte)
    }

    /// True if no byte waits.
    pub fn is_empty(&self) -> bool {
        self.written.load(Ordering::Acquire) == self.read.load(Ordering::Relaxed)
    }
}
