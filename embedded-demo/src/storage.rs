//! Memory that survives a reset: two slots for the readings of the scan, and a boot counter.
//!
//! After a reset (by the watchdog, the button, or a dip of the supply) an interrupted scan continues with its saved
//! readings. RAM loses its content when power is off for longer than a moment; core's checksum detects that. If a board
//! has memory that survives a power cut, name it in `memory/`: the STM32F405 has 4 KiB of backup SRAM, if a battery is
//! at VBAT.

use core::sync::atomic::{AtomicU8, Ordering};

use glimpse_core::error::Error;
use glimpse_core::scan::Saved;

use crate::recipe::{SAMPLES, Scan};

/// Bytes that `memory/` reserves: enough for 67 samples.
const MEMORY_BYTES: usize = 2048;
/// Bytes of the boot counter, at the end of the memory.
const COUNTER_BYTES: usize = 4;
/// Bytes of each slot. Both are at the start of the memory.
const SLOT_BYTES: usize = Saved::slot_bytes(SAMPLES);
const _: () = assert!(
    2 * SLOT_BYTES + COUNTER_BYTES <= MEMORY_BYTES,
    "reserve more memory in MEMORY_BYTES and memory/"
);

// SAFETY: the linker script reserves these bytes for this static alone, and any bytes are valid `AtomicU8`s.
unsafe extern "C" {
    /// Memory that start-up code does not initialize. Atomic, because a mutable static must be. Relaxed writes may
    /// arrive in any order, and late: a CRC at the end of a slot detects half-written ones.
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
pub struct Storage(Saved);

impl Storage {
    /// Records the readings that survived a reset.
    pub fn restore(scan: &mut Scan) -> Self {
        let mut slots = [[0; SLOT_BYTES]; 2];
        for (byte, stored) in slots.as_flattened_mut().iter_mut().zip(&MEMORY) {
            *byte = stored.load(Ordering::Relaxed);
        }
        let [first, second] = &slots;
        let (saved, restored) = Saved::restore([first, second], scan);
        match restored {
            Ok(count) => defmt::info!("{=usize} readings are saved", count),
            Err(error) => defmt::info!("no readings are saved: {}", error),
        }
        Self(saved)
    }

    /// Saves all readings of a scan.
    pub fn write(&mut self, scan: &Scan) {
        if let Err(error) = self.0.write(scan, &mut [0; SLOT_BYTES], store) {
            defmt::warn!("readings are not saved: {}", error);
        }
    }

    /// Deletes all readings.
    pub fn clear(&mut self) {
        let _ = self.0.clear(store); // `store` does not fail
        defmt::info!("all readings are deleted");
    }
}

/// Writes bytes to the start of a slot.
fn store(slot: usize, bytes: &[u8]) -> Result<(), Error> {
    for (stored, byte) in MEMORY.iter().skip(slot * SLOT_BYTES).zip(bytes) {
        stored.store(*byte, Ordering::Relaxed);
    }
    Ok(())
}
