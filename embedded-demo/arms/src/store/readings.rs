//! The readings of the scan under way.
//!
//! A [journal](super::journal) of numbered items: one for each reading, one for the scan. Every call ends in one item, which is there or not. Only [`Readings::discard`] writes several:
//! it says so first, and is carried on with by [`Readings::mount`] if the power goes meanwhile.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::scan::Reading;

use super::StoreError;
use super::journal::{Content, Journal};

/// The number of the scan's item; readings have their index.
const SCAN: u16 = u16::MAX - 1;
/// The number of the boot counter's item.
const BOOTS: u16 = u16::MAX - 2;

/// What is under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Under {
    /// Which scan it is: it counts up. A reading of another one is as none.
    scan: u32,
    /// The checksum of its recipe.
    recipe: u32,
    /// Its number of samples; 0 once it is over.
    samples: u16,
    /// Which stretch between two visits home it is: it counts up.
    stretch: u16,
    /// True while the readings of this stretch are being discarded.
    discarding: bool,
}

/// A reading and where it belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kept {
    scan: u32,
    stretch: u16,
    void: bool,
    reading: Reading,
}

/// The readings of the scan under way, in a range of the flash.
#[derive(Debug)]
pub struct Readings {
    journal: Journal,
    under: Under,
}

impl Readings {
    /// Finds what is under way in two areas of the flash, each of whole sectors. Whatever else they
    /// hold is as nothing.
    ///
    /// # Errors
    /// If it cannot be read, or a reading that is void cannot be marked so.
    pub fn mount<F: NorFlash>(flash: &mut F, areas: [Range<u32>; 2]) -> Result<Self, StoreError> {
        let journal = Journal::mount(flash, areas)?;
        let found = journal.get(flash, SCAN)?;
        let mut readings = Self {
            journal,
            under: found.map(Under::from_content).unwrap_or_default(),
        };
        if readings.under.discarding {
            readings.carry_on_discarding(flash)?;
        }
        Ok(readings)
    }

    /// Counts a boot, and returns the number of boots so far. Call it once after each reset.
    ///
    /// # Errors
    /// If it cannot be read or written.
    pub fn count_boot<F: NorFlash>(&mut self, flash: &mut F) -> Result<u32, StoreError> {
        let content = self.journal.get(flash, BOOTS)?.unwrap_or_default();
        let [a, b, c, d, ..] = content;
        let boots = u32::from_le_bytes([a, b, c, d]).wrapping_add(1);
        let mut content = Content::default();
        for (to, from) in content.iter_mut().zip(boots.to_le_bytes()) {
            *to = from;
        }
        self.put(flash, BOOTS, &content)?;
        Ok(boots)
    }

    /// Whether a scan by this recipe is under way.
    pub fn is_under_way(&self, recipe: u32, samples: u16) -> bool {
        self.under.samples != 0 && (self.under.recipe, self.under.samples) == (recipe, samples)
    }

    /// Begins a scan by a recipe. What was kept of another one is forgotten.
    ///
    /// # Errors
    /// If it cannot be written; then the other one is still under way.
    pub fn begin<F: NorFlash>(
        &mut self,
        flash: &mut F,
        recipe: u32,
        samples: u16,
    ) -> Result<(), StoreError> {
        self.enter(
            flash,
            Under {
                scan: self.under.scan.wrapping_add(1),
                recipe,
                samples,
                stretch: 0,
                discarding: false,
            },
        )
    }

    /// Ends the scan, if one is under way: nothing is any more.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        if self.under.samples == 0 {
            return Ok(());
        }
        let samples = 0;
        let under = self.under;
        self.enter(flash, Under { samples, ..under })
    }

    /// Keeps a reading; one of the same index is replaced.
    ///
    /// # Errors
    /// If no scan is under way, or it cannot be written.
    pub fn keep<F: NorFlash>(
        &mut self,
        flash: &mut F,
        index: u16,
        reading: Reading,
    ) -> Result<(), StoreError> {
        if index >= self.under.samples {
            return Err(StoreError::NoScan);
        }
        let Under { scan, stretch, .. } = self.under;
        let void = false;
        let kept = Kept {
            scan,
            stretch,
            void,
            reading,
        };
        self.put(flash, index, &kept.to_content())
    }

    /// The reading of this index, if it was kept.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn get<F: NorFlash>(
        &self,
        flash: &mut F,
        index: u16,
    ) -> Result<Option<Reading>, StoreError> {
        Ok(self.kept(flash, index)?.map(|kept| kept.reading))
    }

    /// The arms came home without having lost a step: what was read so far stays.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn confirm<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let stretch = self.under.stretch.wrapping_add(1);
        let under = self.under;
        self.enter(flash, Under { stretch, ..under })
    }

    /// The arms had lost steps when they came home: what was read since they were there before is
    /// void.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn discard<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let discarding = true;
        let under = self.under;
        self.enter(
            flash,
            Under {
                discarding,
                ..under
            },
        )?;
        self.carry_on_discarding(flash)
    }

    fn carry_on_discarding<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        for index in 0..self.under.samples {
            if let Some(kept) = self.kept(flash, index)?
                && kept.stretch == self.under.stretch
            {
                let void = true;
                self.put(flash, index, &Kept { void, ..kept }.to_content())?;
            }
        }
        let discarding = false;
        let stretch = self.under.stretch.wrapping_add(1);
        let under = self.under;
        let under = Under {
            stretch,
            discarding,
            ..under
        };
        self.enter(flash, under)
    }

    #[inline(never)] // smaller: there are several calls
    fn kept<F: NorFlash>(&self, flash: &mut F, index: u16) -> Result<Option<Kept>, StoreError> {
        if index >= self.under.samples {
            return Ok(None);
        }
        let kept = self.journal.get(flash, index)?.map(Kept::from_content);
        Ok(kept.filter(|kept| kept.scan == self.under.scan && !kept.void))
    }

    #[inline(never)] // smaller: there are several calls
    fn enter<F: NorFlash>(&mut self, flash: &mut F, under: Under) -> Result<(), StoreError> {
        self.put(flash, SCAN, &under.to_content())?;
        self.under = under;
        Ok(())
    }

    fn put<F: NorFlash>(
        &mut self,
        flash: &mut F,
        number: u16,
        content: &Content,
    ) -> Result<(), StoreError> {
        let numbers = (0..self.under.samples).chain([SCAN, BOOTS]);
        self.journal.put(flash, number, content, numbers)
    }
}

impl Under {
    fn to_content(self) -> Content {
        let [a, b, c, d] = self.scan.to_le_bytes();
        let [e, f, g, h] = self.recipe.to_le_bytes();
        let [i, j] = self.samples.to_le_bytes();
        let [k, l] = self.stretch.to_le_bytes();
        let m = self.discarding.into();
        [
            a, b, c, d, e, f, g, h, i, j, k, l, m, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        ]
    }

    fn from_content(content: Content) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, ..] = content;
        Self {
            scan: u32::from_le_bytes([a, b, c, d]),
            recipe: u32::from_le_bytes([e, f, g, h]),
            samples: u16::from_le_bytes([i, j]),
            stretch: u16::from_le_bytes([k, l]),
            discarding: m != 0,
        }
    }
}

impl Kept {
    fn to_content(self) -> Content {
        let [a, b, c, d] = self.scan.to_le_bytes();
        let [e, f] = self.stretch.to_le_bytes();
        let flags = u8::from(self.void) | u8::from(self.reading.saturated) << 1;
        let [red, green, blue] = self.reading.brdf.map(f32::to_le_bytes);
        let [g, h, i, j] = red;
        let [k, l, m, n] = green;
        let [o, p, q, r] = blue;
        [
            a, b, c, d, e, f, flags, g, h, i, j, k, l, m, n, o, p, q, r, 0, 0, 0,
        ]
    }

    fn from_content(content: Content) -> Self {
        let [a, b, c, d, e, f, flags, rest @ ..] = content;
        let [g, h, i, j, k, l, m, n, o, p, q, r, ..] = rest;
        Self {
            scan: u32::from_le_bytes([a, b, c, d]),
            stretch: u16::from_le_bytes([e, f]),
            void: flags & 1 != 0,
            reading: Reading {
                brdf: [[g, h, i, j], [k, l, m, n], [o, p, q, r]].map(f32::from_le_bytes),
                saturated: flags & 2 != 0,
            },
        }
    }
}
