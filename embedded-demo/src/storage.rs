//! Memory that survives a reset: the readings of the scan, and a boot counter.
//!
//! After a reset (by the watchdog, the button, or a dip of the supply) an interrupted scan continues with its saved
//! readings. RAM loses its content when power is off for longer than a moment; core's checksum detects that. If a board
//! has memory that survives a power cut, name it in `memory/`: the STM32F405 has 4 KiB of backup SRAM, if a battery is
//! at VBAT.

use core::sync::atomic::{AtomicU8, Ordering};

use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Saved};

use crate::recipe::SAMPLES;

/// Bytes that `memory/` reserves: enough for 62 samples.
const MEMORY_BYTES: usize = 1024;
/// Bytes of the boot counter, at the end of the memory.
const COUNTER_BYTES: usize = 4;
const SAVED_BYTES: usize = Saved::<SAMPLES>::BYTES;
const _: () = assert!(
    SAVED_BYTES + COUNTER_BYTES <= MEMORY_BYTES,
    "reserve more memory in MEMORY_BYTES and memory/"
);

// SAFETY: the linker script reserves these bytes for this static alone, and any bytes are valid `AtomicU8`s.
unsafe extern "C" {
    /// Memory that start-up code does not initialize. Atomic, because a mutable static must be. Relaxed writes may
    /// arrive in any order, and late: a CRC at the end of the readings detects half-written ones.
    #[link_name = "_retained"]
    safe static MEMORY: [AtomicU8; MEMORY_BYTES];
}

/// Counts this boot, and returns the count. After a loss of power it starts from an arbitrary value.
pub fn count_boot() -> u32 {
    let counter = MEMORY.iter().skip(MEMORY_BYTES - COUNTER_BYTES);
    let mut bytes = [0; COUNTER_BYTES];
    for (byte, stored) in bytes.iter_mut().zip(counter.clone()) {
        *byte = stored.load(Ordering::Relaxed);
    }
    let count = u32::from_le_bytes(bytes).wrapping_add(1);
    for (stored, byte) in counter.zip(count.to_le_bytes()) {
        stored.store(byte, Ordering::Relaxed);
    }
    count
}

/// The readings of the current scan, in memory that survives a reset.
pub struct Storage {
    saved: Saved<SAMPLES>,
}

impl Storage {
    /// Loads the readings with this recipe that survived a reset.
    pub fn load(recipe: &Recipe<'_>) -> Self {
        let mut bytes = [0; MEMORY_BYTES];
        for (byte, stored) in bytes.iter_mut().zip(&MEMORY) {
            *byte = stored.load(Ordering::Relaxed);
        }
        let saved = Saved::read(&bytes, recipe).unwrap_or_else(|error| {
            defmt::info!("no readings are saved: {}", error);
            Saved::new(recipe)
        });
        defmt::info!("{=usize} readings are saved", saved.readings().len());
        Self { saved }
    }

    /// Returns the readings, with their indices in the recipe's pattern.
    pub fn readings(&self) -> &[(u16, Reading)] {
        self.saved.readings()
    }

    /// Saves a reading, or replaces the one of the same sample.
    pub fn insert(&mut self, index: u16, reading: Reading) {
        match self.saved.insert(index, reading) {
            Ok(()) => self.write(),
            Err(error) => defmt::warn!("reading {=u16} is not saved: {}", index, error),
        }
    }

    /// Deletes all readings.
    pub fn clear(&mut self) {
        self.saved.clear();
        self.write();
        defmt::info!("all readings are deleted");
    }

    fn write(&self) {
        let mut buffer = [0; SAVED_BYTES];
        let bytes = self.saved.write(&mut buffer).unwrap_or_default(); // SAVED_BYTES are enough
        for (stored, byte) in MEMORY.iter().zip(bytes) {
            stored.store(*byte, Ordering::Relaxed);
        }
    }
}
