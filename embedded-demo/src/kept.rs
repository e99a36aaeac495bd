//! Memory that a reset leaves alone, and what was measured in it.
//!
//! A scan that a reset interrupts (the watchdog's, the button's, a dip of the supply) goes on
//! where it was. RAM forgets when power is off for longer than a moment; core's checksum tells. For
//! a board whose memory outlasts that too, name it in `memory/`: the STM32F405 has 4 KiB of backup
//! SRAM, if a battery is at VBAT.

use core::sync::atomic::{AtomicU8, Ordering};

use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Saved};

use crate::recipe::CAPACITY;

/// What `memory/` sets aside: enough for 63 samples.
const MEMORY_BYTES: usize = 1024;
const SAVED_BYTES: usize = Saved::<CAPACITY>::BYTES;
const _: () = assert!(SAVED_BYTES <= MEMORY_BYTES, "set more memory aside");

// SAFETY: the linker script sets these bytes aside for it alone, and any bytes are an `AtomicU8`.
unsafe extern "C" {
    /// Start-up code does not touch it. Atomic, because a static that is written has to be; what is
    /// written relaxed may arrive in any order, and late. That does no harm: the readings end with a
    /// CRC over all of them, so whatever a reset finds half written is none.
    #[link_name = "_kept"]
    safe static MEMORY: [AtomicU8; MEMORY_BYTES];
}

/// The readings of the scan under way, in memory that a reset leaves alone.
pub struct Kept {
    saved: Saved<CAPACITY>,
}

impl Kept {
    /// Looks for readings by this recipe that a reset left.
    pub fn find(recipe: &Recipe<'_>) -> Self {
        let mut bytes = [0; MEMORY_BYTES];
        for (byte, kept) in bytes.iter_mut().zip(&MEMORY) {
            *byte = kept.load(Ordering::Relaxed);
        }
        let saved = Saved::read(&bytes, recipe).unwrap_or_else(|error| {
            defmt::info!("nothing is kept: {}", error);
            Saved::new(recipe)
        });
        defmt::info!("{=usize} readings are kept", saved.readings().len());
        Self { saved }
    }

    /// The readings, with their indices in the recipe's pattern.
    pub fn readings(&self) -> &[(u16, Reading)] {
        self.saved.readings()
    }

    /// Keeps one more, or another one of the same sample.
    pub fn insert(&mut self, index: u16, reading: Reading) {
        match self.saved.insert(index, reading) {
            Ok(()) => self.write(),
            Err(error) => defmt::warn!("reading {=u16} is not kept: {}", index, error),
        }
    }

    /// Keeps none.
    pub fn forget(&mut self) {
        self.saved.clear();
        self.write();
        defmt::info!("all readings are forgotten");
    }

    fn write(&self) {
        let mut buffer = [0; SAVED_BYTES];
        let bytes = self.saved.write(&mut buffer).unwrap_or_default(); // there is room
        for (kept, byte) in MEMORY.iter().zip(bytes) {
            kept.store(*byte, Ordering::Relaxed);
        }
    }
}
