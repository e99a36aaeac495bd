//! Storage that survives a power cut: a boot counter, and the readings of the current scan.
//!
//! A journal holds everything. Every call appends at most one item to it. After a power cut at any time, the flash has
//! the state before the interrupted call or the state after it. Only a full area of the journal causes an erase.
//!
//! Readings count only once a homing has shown that no steps were lost: see [`Store::record_homing`].

mod error;
mod journal;

pub use error::StoreError;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::gonio::Reading;
use serde::{Deserialize, Serialize};

use crate::goniometer::StepCheck;
use error::Result;
use journal::{BLOCK_BYTES, Content, Journal};

/// Place of a store in a flash: two areas of the journal. Lengths are whole sectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Offset of the first area.
    pub start: u32,
    /// Length of an area: at least 128 bytes, and 32 for each sample. Larger areas are erased less often.
    pub area_bytes: u32,
}

/// Item of the journal.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Item {
    Boots(u32),
    /// Checksum and number of samples of the current scan's recipe.
    Scan((u32, u16)),
    /// Index, reading, and true if it is confirmed.
    Reading(u16, Reading, bool),
    /// Confirms all readings.
    Confirm,
    /// Discards all unconfirmed readings.
    Discard,
}

/// State of a store, as its items describe it.
#[derive(Clone, Copy, Debug)]
struct State<const SAMPLES: usize> {
    boots: u32,
    scan: Option<(u32, u16)>,
    /// By index; true if it is confirmed.
    readings: [Option<(Reading, bool)>; SAMPLES],
}

/// A store for scans of up to `SAMPLES` samples.
#[derive(Debug)]
pub struct Store<F, const SAMPLES: usize> {
    flash: F,
    journal: Journal,
    state: State<SAMPLES>,
}

impl<F: NorFlash, const SAMPLES: usize> Store<F, SAMPLES> {
    /// Opens a store. Unknown content is ignored, so a new flash needs no preparation.
    ///
    /// # Errors
    /// If the layout is invalid, or the flash cannot be read.
    pub fn mount(mut flash: F, layout: Layout) -> Result<Self> {
        layout.validate::<F>(flash.capacity(), SAMPLES)?;
        let mut state = State {
            boots: 0,
            scan: None,
            readings: [None; SAMPLES],
        };
        let journal = Journal::mount(&mut flash, layout.start, layout.area_bytes, |content| {
            if let Ok(item) = postcard::from_bytes(&content) {
                state.apply(item);
            }
        })?;
        Ok(Self {
            flash,
            journal,
            state,
        })
    }

    /// Counts a boot, and returns the number of boots including this one. Call it once after each reset.
    ///
    /// # Errors
    /// If the flash cannot be written.
    pub fn count_boot(&mut self) -> Result<u32> {
        self.write(Item::Boots(self.state.boots.wrapping_add(1)))?;
        Ok(self.state.boots)
    }

    /// Returns checksum and number of samples of the current scan's recipe.
    pub fn scan(&self) -> Option<(u32, u16)> {
        self.state.scan
    }

    /// Begins a scan with a recipe, given by its checksum and number of samples, and deletes all readings.
    ///
    /// # Errors
    /// If the scan has too many samples, or the flash cannot be written.
    pub fn begin_scan(&mut self, recipe: u32, samples: u16) -> Result {
        if usize::from(samples) > SAMPLES {
            return Err(StoreError::TooLarge);
        }
        self.write(Item::Scan((recipe, samples)))
    }

    /// Saves an unconfirmed reading, or replaces the one of the same index.
    ///
    /// # Errors
    /// If the current scan has no such index, the reading is invalid, or the flash cannot be written.
    pub fn save(&mut self, index: u16, reading: Reading) -> Result {
        if self.state.scan.is_none_or(|(_, samples)| index >= samples) {
            return Err(StoreError::NoSample);
        }
        reading.check(index).map_err(StoreError::Invalid)?;
        self.write(Item::Reading(index, reading, false))
    }

    /// Returns the confirmed reading of this index.
    pub fn reading(&self, index: u16) -> Option<Reading> {
        let (reading, is_confirmed) = (*self.state.readings.get(usize::from(index))?)?;
        is_confirmed.then_some(reading)
    }

    /// Confirms all readings if no steps were lost, else discards the unconfirmed ones. Call it after each homing.
    /// Writes nothing without unconfirmed readings.
    ///
    /// # Errors
    /// If the flash cannot be written.
    pub fn record_homing(&mut self, check: StepCheck) -> Result {
        let mut readings = self.state.readings.iter().flatten();
        match check {
            _ if readings.all(|(_, is_confirmed)| *is_confirmed) => Ok(()),
            StepCheck::Passed => self.write(Item::Confirm),
            StepCheck::Unknown | StepCheck::Lost(..) => self.write(Item::Discard),
        }
    }

    fn write(&mut self, item: Item) -> Result {
        let mut state = self.state;
        state.apply(item);
        let contents = state.items().map(Item::content);
        let flash = &mut self.flash;
        self.journal.append(flash, item.content(), contents)?;
        self.state = state;
        Ok(())
    }
}

impl Item {
    fn content(self) -> Content {
        let mut content = Content::default();
        // The largest item is a reading, with 17 bytes.
        let _ = postcard::to_slice(&self, &mut content);
        content
    }
}

impl<const SAMPLES: usize> State<SAMPLES> {
    fn apply(&mut self, item: Item) {
        match item {
            Item::Boots(boots) => self.boots = boots,
            Item::Scan(scan) => {
                self.scan = Some(scan).filter(|(_, samples)| usize::from(*samples) <= SAMPLES);
                self.readings = [None; SAMPLES];
            }
            Item::Reading(index, reading, is_confirmed) => {
                if let Some(saved) = self.readings.get_mut(usize::from(index)) {
                    *saved = Some((reading, is_confirmed));
                }
            }
            Item::Confirm => {
                for (_, is_confirmed) in self.readings.iter_mut().flatten() {
                    *is_confirmed = true;
                }
            }
            Item::Discard => {
                for saved in &mut self.readings {
                    *saved = saved.filter(|(_, is_confirmed)| *is_confirmed);
                }
            }
        }
    }

    /// Returns items that describe this state.
    fn items(&self) -> impl Iterator<Item = Item> {
        let readings = (0..).zip(&self.readings).filter_map(|(index, saved)| {
            saved.map(|(reading, is_confirmed)| Item::Reading(index, reading, is_confirmed))
        });
        let boots = core::iter::once(Item::Boots(self.boots));
        boots.chain(self.scan.map(Item::Scan)).chain(readings)
    }
}

impl Layout {
    /// Checks that the sectors exist, and that an area has room for the items of a full store and one more.
    fn validate<F: NorFlash>(self, capacity: usize, samples: usize) -> Result {
        let has_blocks = F::ERASE_SIZE.is_multiple_of(BLOCK_BYTES);
        let has_words = BLOCK_BYTES.is_multiple_of(F::WRITE_SIZE);
        let lengths = [self.start, self.area_bytes].map(u64::from);
        let [start, area] = lengths;
        let is_whole = |length: &u64| length.is_multiple_of(F::ERASE_SIZE as u64);
        let is_aligned = lengths.iter().all(is_whole);
        let is_inside = start + 2 * area <= capacity as u64;
        let is_large = area / BLOCK_BYTES as u64 >= samples as u64 + 4;
        let is_valid = has_blocks && has_words && is_aligned && is_inside && is_large;
        is_valid.then_some(()).ok_or(StoreError::Layout)
    }
}
