//! A store in flash that survives a reset and a power cut: the readings of a scan, the position of the arms, and the
//! calibration.
//!
//! A journal holds everything. Every call appends at most one item to it. After a power cut at any time, the flash has
//! the state before the interrupted call or the state after it. Only a full area of the journal causes an erase: with
//! areas of 8 KiB one in 250 items.

mod journal;

use embedded_storage::nor_flash::NorFlash;
use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::gonio::Reading;
use crate::recipe::Recipe;
use crate::scan::{Scan, index_error};
use journal::{Content, ITEM_BYTES, Journal};

/// Place of a store in a flash: two areas of the journal. Lengths are whole sectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Offset of the first area.
    pub start: u32,
    /// Length of an area: at least 256 bytes, and 32 for each sample. Larger areas are erased less often.
    pub area_bytes: u32,
}

/// Item of the journal.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Item {
    Boots(u32),
    /// Begins a scan with the recipe of this checksum and number of samples.
    Scan(u32, u16),
    /// Angles of the arms at rest; None while they move.
    Angles(Option<[f32; 4]>),
    /// The checksum of settings that were proven to be right.
    Proven(u32),
    Dark([f32; 3]),
    White([f32; 3]),
    /// Index, reading or skip, and true if it is confirmed.
    Sample(u16, Option<Reading>, bool),
    /// Confirms all samples, or discards the unconfirmed ones.
    Confirm(bool),
}

/// A store for the scans of a device.
///
/// Samples that are saved unconfirmed count once [`Store::confirm`] was called: after a homing has shown that no steps
/// were lost.
///
/// ```
/// # use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
/// # struct Flash([u8; 1024]);
/// # impl ErrorType for Flash { type Error = NorFlashErrorKind; }
/// # impl ReadNorFlash for Flash {
/// #     const READ_SIZE: usize = 1;
/// #     fn read(&mut self, at: u32, to: &mut [u8]) -> Result<(), NorFlashErrorKind> {
/// #         to.copy_from_slice(&self.0[at as usize..][..to.len()]); Ok(())
/// #     }
/// #     fn capacity(&self) -> usize { 1024 }
/// # }
/// # impl NorFlash for Flash {
/// #     const WRITE_SIZE: usize = 1;
/// #     const ERASE_SIZE: usize = 512;
/// #     fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
/// #         self.0[from as usize..to as usize].fill(0xFF); Ok(())
/// #     }
/// #     fn write(&mut self, at: u32, from: &[u8]) -> Result<(), NorFlashErrorKind> {
/// #         self.0[at as usize..][..from.len()].copy_from_slice(from); Ok(())
/// #     }
/// # }
/// # let mut flash = Flash([0xFF; 1024]);
/// use glimpse_core::gonio::Reading;
/// use glimpse_core::model::Neural;
/// use glimpse_core::recipe::{Recipe, memory_words};
/// use glimpse_core::scan::Scan;
/// use glimpse_core::store::{Layout, Store};
///
/// static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
/// let mut memory = [0.0; memory_words(&[RECIPE])];
/// let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
/// let layout = Layout { start: 0, area_bytes: 512 };
/// let mut store = Store::mount(&mut flash, layout, scan.recipe())?;
/// store.save(3, Some(Reading::new([0.2, 0.1, 0.05])), true)?; // for `Action::Save`
/// drop(store);
///
/// // After a reset.
/// let mut store = Store::mount(&mut flash, layout, scan.recipe())?;
/// assert_eq!(store.restore(&mut scan)?, 1);
/// assert_eq!(scan.reading(3), Some(Reading::new([0.2, 0.1, 0.05])));
/// store.clear()?; // for `Action::Forget`
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    journal: Journal,
    /// Checksum and number of samples of the recipe.
    recipe: (u32, u16),
    state: State,
}

/// All items but those of samples.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    boots: u32,
    scan: Option<(u32, u16)>,
    angles: Option<[f32; 4]>,
    proven: Option<u32>,
    dark: Option<[f32; 3]>,
    white: Option<[f32; 3]>,
}

/// The most items of a [`State`].
const STATE_ITEMS: u32 = 6;

impl<F: NorFlash> Store<F> {
    /// Opens a store for scans with a recipe, and deletes samples of another one. Unknown content is ignored, so a new flash
    /// needs no preparation.
    ///
    /// # Errors
    /// [`ErrorCode::StoreLayout`] if the layout is invalid, or [`ErrorCode::Storage`].
    pub fn mount(mut flash: F, layout: Layout, recipe: &Recipe<'_>) -> Result<Self, Error> {
        let recipe = (recipe.checksum(), recipe.samples() as u16);
        layout.validate::<F>(flash.capacity(), recipe.1)?;
        let journal = Journal::mount(&mut flash, layout.start, layout.area_bytes)?;
        let mut state = State::default();
        journal.read_all(&mut flash, |content| state.apply(Item::of(content)))?;
        let mut store = Self {
            flash,
            journal,
            recipe,
            state,
        };
        if state.scan != Some(recipe) {
            store.clear()?;
        }
        Ok(store)
    }

    /// The flash.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// Counts a boot, and returns the number of boots including this one. Call it once after each reset.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn count_boot(&mut self) -> Result<u32, Error> {
        self.write(Item::Boots(self.state.boots.wrapping_add(1)))?;
        Ok(self.state.boots)
    }

    /// Deletes all samples.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn clear(&mut self) -> Result<(), Error> {
        self.write(Item::Scan(self.recipe.0, self.recipe.1))
    }

    /// Saves a reading, or with None a skip. It replaces an earlier one of the same index.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingIndex`], the error of [`Reading::check`], or [`ErrorCode::Storage`].
    pub fn save(
        &mut self,
        index: u16,
        reading: Option<Reading>,
        is_confirmed: bool,
    ) -> Result<(), Error> {
        let (_, samples) = self.recipe;
        if index >= samples {
            return Err(index_error(index, samples.into()));
        }
        reading.map_or(Ok(()), |reading| reading.check(index))?;
        self.write(Item::Sample(index, reading, is_confirmed))
    }

    /// Confirms all samples, because a homing has shown that no steps were lost, or else deletes the unconfirmed ones.
    /// Writes nothing without unconfirmed ones.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn confirm(&mut self, are_valid: bool) -> Result<(), Error> {
        for index in 0..self.recipe.1 {
            if let Some((_, false)) = sample(&mut self.flash, &self.journal, index)? {
                return self.write(Item::Confirm(are_valid));
            }
        }
        Ok(())
    }

    /// Records the confirmed samples in a scan. Returns the number of readings.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn restore<K: ScanModel>(&mut self, scan: &mut Scan<'_, K>) -> Result<u16, Error> {
        let mut count: u16 = 0;
        for index in 0..self.recipe.1 {
            // The scan checks the reading again: one that it refuses is read again.
            match sample(&mut self.flash, &self.journal, index)? {
                Some((Some(reading), true)) => {
                    count = count.saturating_add(u16::from(scan.record(index, reading).is_ok()));
                }
                Some((None, true)) => _ = scan.skip(index),
                _ => {}
            }
        }
        Ok(count)
    }

    /// The angles of the axes at rest, radians. None if they were moving.
    #[must_use]
    pub fn angles(&self) -> Option<[f32; 4]> {
        self.state.angles
    }

    /// Saves the angles of the axes at rest, or None before a move.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn save_angles(&mut self, angles: Option<[f32; 4]>) -> Result<(), Error> {
        self.write(Item::Angles(angles))
    }

    /// Returns true if settings with this checksum were proven to be right.
    #[must_use]
    pub fn is_proven(&self, settings: u32) -> bool {
        self.state.proven == Some(settings)
    }

    /// Saves that settings with this checksum are right.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn save_proven(&mut self, settings: u32) -> Result<(), Error> {
        self.write(Item::Proven(settings))
    }

    /// The counts in the dark and on the white tile. None without a calibration.
    #[must_use]
    pub fn white(&self) -> Option<([f32; 3], [f32; 3])> {
        self.state.dark.zip(self.state.white)
    }

    /// Saves the counts in the dark and on the white tile.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`]. The store has no calibration then.
    pub fn save_white(&mut self, dark: [f32; 3], white: [f32; 3]) -> Result<(), Error> {
        self.write(Item::Dark(dark))?;
        self.write(Item::White(white))
    }

    /// Appends an item. If the area is full, the items that count are copied to the other one first.
    fn write(&mut self, item: Item) -> Result<(), Error> {
        let content = item.content();
        let Self { flash, journal, .. } = self;
        if !journal.append(flash, &content)? {
            let items = self.state.items();
            let candidates = STATE_ITEMS.saturating_add(self.recipe.1.into());
            journal.copy(flash, candidates, |flash, journal, number| {
                let item = match number.checked_sub(STATE_ITEMS) {
                    None => items.get(number as usize).copied().flatten(),
                    Some(index) => {
                        let index = index as u16; // below the number of samples
                        let sample = sample(flash, journal, index)?;
                        sample.map(|(reading, is_confirmed)| {
                            Item::Sample(index, reading, is_confirmed)
                        })
                    }
                };
                Ok(item.map(Item::content))
            })?;
            journal.append(flash, &content)?; // a valid layout has room
        }
        self.state.apply(Some(item));
        Ok(())
    }
}

/// Returns a sample: its reading or skip, and true if it is confirmed.
fn sample(
    flash: &mut impl NorFlash,
    journal: &Journal,
    index: u16,
) -> Result<Option<(Option<Reading>, bool)>, Error> {
    let mut sample = None;
    journal.read_all(flash, |content| match Item::of(content) {
        Some(Item::Scan(..)) => sample = None,
        Some(Item::Sample(at, reading, is_confirmed)) if at == index => {
            sample = Some((reading, is_confirmed));
        }
        Some(Item::Confirm(true)) => sample = sample.map(|(reading, _)| (reading, true)),
        Some(Item::Confirm(false)) => sample = sample.filter(|(_, is_confirmed)| *is_confirmed),
        _ => {}
    })?;
    Ok(sample)
}

impl Item {
    fn of(content: &Content) -> Option<Self> {
        postcard::from_bytes(content).ok()
    }

    fn content(self) -> Content {
        let mut content = Content::default();
        // The largest item is a sample, with 19 bytes.
        let _ = postcard::to_slice(&self, &mut content);
        content
    }
}

impl State {
    fn apply(&mut self, item: Option<Item>) {
        match item {
            Some(Item::Boots(boots)) => self.boots = boots,
            Some(Item::Scan(recipe, samples)) => self.scan = Some((recipe, samples)),
            Some(Item::Angles(angles)) => self.angles = angles,
            Some(Item::Proven(settings)) => self.proven = Some(settings),
            Some(Item::Dark(dark)) => (self.dark, self.white) = (Some(dark), None),
            Some(Item::White(white)) => self.white = Some(white),
            Some(Item::Sample(..) | Item::Confirm(_)) | None => {}
        }
    }

    fn items(&self) -> [Option<Item>; STATE_ITEMS as usize] {
        [
            Some(Item::Boots(self.boots)),
            self.scan
                .map(|(recipe, samples)| Item::Scan(recipe, samples)),
            Some(Item::Angles(self.angles)),
            self.proven.map(Item::Proven),
            self.dark.map(Item::Dark),
            self.white.map(Item::White),
        ]
    }
}

impl Layout {
    /// Checks that the sectors exist, and that an area has room for its header, all items that count and one more.
    fn validate<F: NorFlash>(self, capacity: usize, samples: u16) -> Result<(), Error> {
        let has_blocks = F::ERASE_SIZE.is_multiple_of(ITEM_BYTES as usize);
        let has_words = (ITEM_BYTES as usize).is_multiple_of(F::WRITE_SIZE);
        let lengths = [self.start, self.area_bytes].map(u64::from);
        let [start, area] = lengths;
        let is_whole = |length: &u64| length.is_multiple_of(F::ERASE_SIZE as u64);
        let end = area.saturating_mul(2).saturating_add(start);
        let needed = u64::from(samples)
            .saturating_add(u64::from(STATE_ITEMS))
            .saturating_add(2);
        let is_valid = has_blocks
            && has_words
            && lengths.iter().all(is_whole)
            && end <= capacity as u64
            && area >= needed.saturating_mul(ITEM_BYTES.into());
        let error = Error::new(ErrorCode::StoreLayout);
        is_valid.then_some(()).ok_or(error)
    }
}
