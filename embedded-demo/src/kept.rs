//! Memory that a reset leaves alone, and what was measured in it.
//!
//! A scan that a reset interrupts (the watchdog's, the button's, a dip of the supply) goes on
//! where it was. RAM forgets when power is off for longer than a moment; core's checksum tells. For
//! a board whose memory outlasts that too, name it in `memory/`: the STM32F405 has 4 KiB of backup
//! SRAM, if a battery is at VBAT.

use core::sync::atomic::{AtomicU8, Ordering};

use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Measurement, Record};

use crate::CAPACITY;

/// What `memory/` sets aside.
const MEMORY_BYTES: usize = 256;
const RECORD_BYTES: usize = Record::<CAPACITY>::BYTES;
const _: () = assert!(RECORD_BYTES <= MEMORY_BYTES, "set more memory aside");

// SAFETY: the linker script sets these bytes aside for it alone, and any bytes are an `AtomicU8`.
unsafe extern "C" {
    /// Start-up code does not touch it. Atomic, because a static that is written has to be; what is
    /// written relaxed may arrive in any order, and late. That does no harm: the record ends with a
    /// CRC over all of it, so whatever a reset finds half written is none.
    #[link_name = "_kept"]
    safe static MEMORY: [AtomicU8; MEMORY_BYTES];
}

/// The measurements of the scan under way, in memory that a reset leaves alone.
pub struct Kept {
    record: Record<CAPACITY>,
}

impl Kept {
    /// Looks for measurements by this recipe that a reset left.
    pub fn find(recipe: &Recipe<'_>) -> Self {
        let mut bytes = [0; MEMORY_BYTES];
        for (byte, kept) in bytes.iter_mut().zip(&MEMORY) {
            *byte = kept.load(Ordering::Relaxed);
        }
        let record = Record::read(&bytes, recipe).unwrap_or_else(|error| {
            defmt::info!("nothing is kept: {}", error);
            Record::new(recipe)
        });
        Self { record }
    }

    /// The measurements, in the order of the recipe's pattern.
    pub fn measurements(&self) -> &[Measurement] {
        self.record.measurements()
    }

    /// Keeps one more.
    pub fn add(&mut self, measurement: Measurement) {
        if self.record.push(measurement).is_ok() {
            self.write();
        }
    }

    /// Keeps none.
    pub fn forget(&mut self) {
        self.record.clear();
        self.write();
    }

    fn write(&self) {
        let mut buffer = [0; RECORD_BYTES];
        let bytes = self.record.write(&mut buffer).unwrap_or_default(); // there is room
        for (kept, byte) in MEMORY.iter().zip(bytes) {
            kept.store(*byte, Ordering::Relaxed);
        }
    }
}
