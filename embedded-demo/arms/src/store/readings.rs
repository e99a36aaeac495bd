//! The readings of the current scan.
//!
//! They are stored in a [journal](super::journal): an item for each reading, and one for the scan. Every call writes
//! one item, which is complete or absent after a power cut. Only [`Readings::discard_unconfirmed`] writes several: it
//! first marks the scan, so [`Readings::mount`] can complete it after a power cut.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::scan::Reading;

use super::StoreError;
use super::journal::{Content, Journal};

/// Number of the scan's item. Readings have their index as number.
const SCAN: u16 = u16::MAX - 1;
/// Number of the boot counter's item.
const BOOTS: u16 = u16::MAX - 2;

/// Stored description of the current scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct ScanRecord {
    /// Counter of scans. Readings of other scans are ignored.
    id: u32,
    /// Checksum of the recipe.
    recipe: u32,
    /// Number of samples; 0 once the scan has ended.
    samples: u16,
    /// Counter of the homings in this scan.
    segment: u16,
    /// True while the readings of this segment are being discarded.
    discarding: bool,
}

/// Stored reading.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SavedReading {
    scan_id: u32,
    segment: u16,
    discarded: bool,
    reading: Reading,
}

/// The readings of the current scan, in a range of the flash.
#[derive(Debug)]
pub struct Readings {
    journal: Journal,
    scan: ScanRecord,
}

impl Readings {
    /// Opens two areas of the flash, each of whole sectors, and finds the current scan. Unknown content is ignored.
    ///
    /// # Errors
    /// If the flash cannot be read, or an interrupted [`Readings::discard_unconfirmed`] cannot be completed.
    pub fn mount<F: NorFlash>(flash: &mut F, areas: [Range<u32>; 2]) -> Result<Self, StoreError> {
        let journal = Journal::mount(flash, areas)?;
        let scan = journal.get(flash, SCAN)?;
        let mut readings = Self {
            journal,
            scan: scan.map(ScanRecord::from_content).unwrap_or_default(),
        };
        if readings.scan.discarding {
            readings.finish_discarding(flash)?;
        }
        Ok(readings)
    }

    /// Counts a boot, and returns the number of boots including this one. Call it once after each reset.
    ///
    /// # Errors
    /// If the flash cannot be read or written.
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

    /// Returns true if a scan with this recipe is under way.
    pub fn is_under_way(&self, recipe: u32, samples: u16) -> bool {
        self.scan.samples != 0 && (self.scan.recipe, self.scan.samples) == (recipe, samples)
    }

    /// Begins a scan with a recipe. Saved readings of another scan are deleted.
    ///
    /// # Errors
    /// If the flash cannot be written. The other scan is still under way then.
    pub fn begin_scan<F: NorFlash>(
        &mut self,
        flash: &mut F,
        recipe: u32,
        samples: u16,
    ) -> Result<(), StoreError> {
        self.write_scan(
            flash,
            ScanRecord {
                id: self.scan.id.wrapping_add(1),
                recipe,
                samples,
                segment: 0,
                discarding: false,
            },
        )
    }

    /// Ends the scan, if one is under way, and deletes its readings.
    ///
    /// # Errors
    /// If the flash cannot be written.
    pub fn end_scan<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        if self.scan.samples == 0 {
            return Ok(());
        }
        let samples = 0;
        let scan = self.scan;
        self.write_scan(flash, ScanRecord { samples, ..scan })
    }

    /// Saves a reading, or replaces the one of the same index.
    ///
    /// # Errors
    /// If no scan with this index is under way, or the flash cannot be written.
    pub fn save<F: NorFlash>(
        &mut self,
        flash: &mut F,
        index: u16,
        reading: Reading,
    ) -> Result<(), StoreError> {
        if index >= self.scan.samples {
            return Err(StoreError::NoScan);
        }
        let saved = SavedReading {
            scan_id: self.scan.id,
            segment: self.scan.segment,
            discarded: false,
            reading,
        };
        self.put(flash, index, &saved.to_content())
    }

    /// Returns the saved reading of this index, if there is one.
    ///
    /// # Errors
    /// If the flash cannot be read.
    pub fn get<F: NorFlash>(
        &self,
        flash: &mut F,
        index: u16,
    ) -> Result<Option<Reading>, StoreError> {
        Ok(self.saved(flash, index)?.map(|saved| saved.reading))
    }

    /// Confirms all readings since the last homing, because no steps were lost.
    ///
    /// # Errors
    /// If the flash cannot be written.
    pub fn confirm<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let segment = self.scan.segment.wrapping_add(1);
        let scan = self.scan;
        self.write_scan(flash, ScanRecord { segment, ..scan })
    }

    /// Discards all readings since the last homing, because steps were lost.
    ///
    /// # Errors
    /// If the flash cannot be written.
    pub fn discard_unconfirmed<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        let discarding = true;
        let scan = self.scan;
        self.write_scan(flash, ScanRecord { discarding, ..scan })?;
        self.finish_discarding(flash)
    }

    fn finish_discarding<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StoreError> {
        for index in 0..self.scan.samples {
            if let Some(saved) = self.saved(flash, index)?
                && saved.segment == self.scan.segment
            {
                let discarded = true;
                let saved = SavedReading { discarded, ..saved };
                self.put(flash, index, &saved.to_content())?;
            }
        }
        let scan = ScanRecord {
            segment: self.scan.segment.wrapping_add(1),
            discarding: false,
            ..self.scan
        };
        self.write_scan(flash, scan)
    }

    #[inline(never)] // saves flash: one copy for several calls
    fn saved<F: NorFlash>(
        &self,
        flash: &mut F,
        index: u16,
    ) -> Result<Option<SavedReading>, StoreError> {
        if index >= self.scan.samples {
            return Ok(None);
        }
        let saved = self.journal.get(flash, index)?;
        let saved = saved.map(SavedReading::from_content);
        Ok(saved.filter(|saved| saved.scan_id == self.scan.id && !saved.discarded))
    }

    #[inline(never)] // saves flash: one copy for several calls
    fn write_scan<F: NorFlash>(
        &mut self,
        flash: &mut F,
        scan: ScanRecord,
    ) -> Result<(), StoreError> {
        self.put(flash, SCAN, &scan.to_content())?;
        self.scan = scan;
        Ok(())
    }

    fn put<F: NorFlash>(
        &mut self,
        flash: &mut F,
        number: u16,
        content: &Content,
    ) -> Result<(), StoreError> {
        let numbers = (0..self.scan.samples).chain([SCAN, BOOTS]);
        self.journal.put(flash, number, content, numbers)
    }
}

impl ScanRecord {
    fn to_content(self) -> Content {
        let [a, b, c, d] = self.id.to_le_bytes();
        let [e, f, g, h] = self.recipe.to_le_bytes();
        let [i, j] = self.samples.to_le_bytes();
        let [k, l] = self.segment.to_le_bytes();
        let m = self.discarding.into();
        [
            a, b, c, d, e, f, g, h, i, j, k, l, m, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        ]
    }

    fn from_content(content: Content) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, ..] = content;
        Self {
            id: u32::from_le_bytes([a, b, c, d]),
            recipe: u32::from_le_bytes([e, f, g, h]),
            samples: u16::from_le_bytes([i, j]),
            segment: u16::from_le_bytes([k, l]),
            discarding: m != 0,
        }
    }
}

impl SavedReading {
    fn to_content(self) -> Content {
        let [a, b, c, d] = self.scan_id.to_le_bytes();
        let [e, f] = self.segment.to_le_bytes();
        let flags = u8::from(self.discarded) | u8::from(self.reading.saturated) << 1;
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
            scan_id: u32::from_le_bytes([a, b, c, d]),
            segment: u16::from_le_bytes([e, f]),
            discarded: flags & 1 != 0,
            reading: Reading {
                brdf: [[g, h, i, j], [k, l, m, n], [o, p, q, r]].map(f32::from_le_bytes),
                saturated: flags & 2 != 0,
            },
        }
    }
}
