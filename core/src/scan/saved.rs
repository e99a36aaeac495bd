//! Readings as bytes, for memory that survives a reset.
//!
//! All readings are written again after each one, in turn to two slots. A reset during a write leaves the other slot
//! intact, so it loses at most the reading that is being written.
//!
//! # Format of a slot
//!
//! | bytes | content, little-endian |
//! |---|---|
//! | 0..4 | the recipe's checksum |
//! | 4..8 | generation: the number of the write; the intact slot with the later one counts |
//! | 8..10 | number of readings |
//! | 15 for each reading | index: u16; BRDF: 3 f32; saturated: 0 or 1 |
//! | 4 | CRC-32 (ISO-HDLC) of all bytes before |
//!
//! Bytes after the CRC are ignored.

use super::Scan;
use super::reading::index_error;
use crate::checksum::crc_32;
use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::gonio::Reading;

const HEADER_BYTES: usize = 10;
const READING_BYTES: usize = 15;
const CHECKSUM_BYTES: usize = 4;

/// Two slots of memory that survives a reset, with the readings of a scan.
///
/// The slots may be ranges of battery-backed RAM, or sectors of flash that are erased one at a time. They may be longer
/// than [`Saved::slot_bytes`], and a write may be padded. Skipped samples are not saved: after a reset they are pending
/// again.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::model::Neural;
/// use glimpse_core::recipe::{Recipe, max_samples, memory_words};
/// use glimpse_core::gonio::Reading;
/// use glimpse_core::scan::{Saved, Scan};
///
/// static RECIPE: &[u8] = include_bytes!("../../examples/recipes/neural-n8.recipe");
/// const SLOT_BYTES: usize = Saved::slot_bytes(max_samples(&[RECIPE]));
///
/// let mut memory = [0.0; memory_words(&[RECIPE])];
/// let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
/// let mut slots = [[0xff; SLOT_BYTES]; 2]; // erased
/// let (mut saved, restored) = Saved::restore([&slots[0], &slots[1]], &mut scan);
/// assert_eq!(restored, Err(Error::new(ErrorCode::SavedDamaged)));
///
/// scan.record(3, Reading::new([0.2, 0.1, 0.05]))?;
/// saved.write(&scan, &mut [0; SLOT_BYTES], |slot, bytes| {
///     slots[slot][..bytes.len()].copy_from_slice(bytes); // erase and write this slot only
///     Ok::<_, Error>(())
/// })?;
///
/// // After a reset.
/// scan.restart();
/// let (saved, restored) = Saved::restore([&slots[0], &slots[1]], &mut scan);
/// assert_eq!(restored, Ok(1));
/// assert_eq!(scan.reading(3), Some(Reading::new([0.2, 0.1, 0.05])));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Saved {
    /// The number of the last write.
    generation: u32,
    /// The slot of the next write: the one that does not hold the last.
    next: usize,
}

impl Saved {
    /// The size of a slot in bytes, for recipes of at most this number of samples
    /// ([`max_samples`](crate::recipe::max_samples)).
    #[must_use]
    pub const fn slot_bytes(samples: usize) -> usize {
        samples
            .saturating_mul(READING_BYTES)
            .saturating_add(HEADER_BYTES + CHECKSUM_BYTES)
    }

    /// Finds the slot of the next write, like [`Saved::restore`] but without a scan: firmware that reads its slots before
    /// each write needs no other state.
    #[must_use]
    pub fn find(slots: [&[u8]; 2]) -> Self {
        newest(slots).0
    }

    /// Records the readings that survived a reset. Returns their number, or the reason why none was recorded. In both
    /// cases the next write goes to the slot that is not needed.
    pub fn restore<K: ScanModel>(
        slots: [&[u8]; 2],
        scan: &mut Scan<'_, K>,
    ) -> (Self, Result<usize, Error>) {
        let (saved, content) = newest(slots);
        let Some(content) = content else {
            return (saved, Err(Error::new(ErrorCode::SavedDamaged)));
        };
        let (recipe, samples) = (scan.recipe().checksum(), scan.recipe().samples() as u16);
        if let Err(error) = content.check(recipe, samples) {
            return (saved, Err(error));
        }
        let mut count: usize = 0;
        for (index, reading) in content.readings() {
            // The check has passed, so no reading is refused.
            count = count.saturating_add(usize::from(scan.record(index, reading).is_ok()));
        }
        (saved, Ok(count))
    }

    /// Writes all readings of a scan. `store` receives the index of the slot, 0 or 1, and the bytes at its start. If
    /// `store` fails, the next write goes to the same slot, so that the other one stays intact.
    ///
    /// # Errors
    /// [`ErrorCode::BufferTooSmall`] if `buffer` is smaller than [`Saved::slot_bytes`], or the error of `store`.
    pub fn write<K: ScanModel, E: From<Error>>(
        &mut self,
        scan: &Scan<'_, K>,
        buffer: &mut [u8],
        store: impl FnOnce(usize, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let samples = scan.recipe().samples() as u16;
        let bytes = self.encode(
            scan.recipe().checksum(),
            samples,
            &|index| scan.reading(index),
            buffer,
        );
        store(self.next, bytes?)?;
        self.advance();
        Ok(())
    }

    /// Deletes all readings, by writing an empty list like [`Saved::write`].
    ///
    /// # Errors
    /// The error of `store`.
    pub fn clear<E: From<Error>>(
        &mut self,
        store: impl FnOnce(usize, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut buffer = [0; Self::slot_bytes(0)];
        store(self.next, self.encode(0, 0, &|_| None, &mut buffer)?)?;
        self.advance();
        Ok(())
    }

    fn advance(&mut self) {
        self.generation = self.generation.wrapping_add(1);
        self.next ^= 1;
    }

    /// Encodes the next write.
    #[inline(never)]
    fn encode<'b>(
        &self,
        recipe: u32,
        samples: u16,
        reading: &dyn Fn(u16) -> Option<Reading>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], Error> {
        let full = Error::new(ErrorCode::BufferTooSmall);
        let (header, rest) = buffer.split_first_chunk_mut::<HEADER_BYTES>().ok_or(full)?;
        let mut records = rest.as_chunks_mut::<READING_BYTES>().0.iter_mut();
        let mut count: u16 = 0;
        for index in 0..samples {
            if let Some(reading) = reading(index) {
                *records.next().ok_or(full)? = pack(index, reading);
                count = count.saturating_add(1);
            }
        }
        let [a, b, c, d] = recipe.to_le_bytes();
        let [e, f, g, h] = self.generation.wrapping_add(1).to_le_bytes();
        let [i, j] = count.to_le_bytes();
        *header = [a, b, c, d, e, f, g, h, i, j];
        let length = usize::from(count)
            .saturating_mul(READING_BYTES)
            .saturating_add(HEADER_BYTES);
        let (content, rest) = buffer.split_at_mut_checked(length).unwrap_or_default();
        *rest.first_chunk_mut().ok_or(full)? = crc_32(content).to_le_bytes();
        let end = length.saturating_add(CHECKSUM_BYTES);
        buffer.get(..end).ok_or(full)
    }
}

/// The content of an intact slot.
#[derive(Clone, Copy)]
struct Content<'a> {
    recipe: u32,
    generation: u32,
    records: &'a [[u8; READING_BYTES]],
}

impl<'a> Content<'a> {
    /// Decodes a slot. None if its checksum is wrong.
    fn decode(slot: &'a [u8]) -> Option<Self> {
        let (header, rest) = slot.split_first_chunk::<HEADER_BYTES>()?;
        let [a, b, c, d, e, f, g, h, i, j] = *header;
        let length = usize::from(u16::from_le_bytes([i, j])).saturating_mul(READING_BYTES);
        let (records, rest) = rest.split_at_checked(length)?;
        let content = slot.get(..length.saturating_add(HEADER_BYTES))?;
        let checksum = rest.first_chunk()?;
        (u32::from_le_bytes(*checksum) == crc_32(content)).then_some(Self {
            recipe: u32::from_le_bytes([a, b, c, d]),
            generation: u32::from_le_bytes([e, f, g, h]),
            records: records.as_chunks().0,
        })
    }

    fn readings(&self) -> impl Iterator<Item = (u16, Reading)> {
        self.records.iter().map(unpack)
    }

    /// Checks that all readings can be recorded. An empty list belongs to any recipe.
    fn check(&self, recipe: u32, samples: u16) -> Result<(), Error> {
        if self.recipe != recipe && !self.records.is_empty() {
            return Err(Error::with(ErrorCode::SavedRecipe, [self.recipe, 0]));
        }
        for (index, reading) in self.readings() {
            if index >= samples {
                return Err(index_error(index, samples.into()));
            }
            reading.check(index)?;
        }
        Ok(())
    }
}

/// Returns the intact slot with the latest generation, if there is one.
#[inline(never)]
fn newest(slots: [&[u8]; 2]) -> (Saved, Option<Content<'_>>) {
    let [first, second] = slots.map(Content::decode);
    let (content, slot) = match (first, second) {
        (Some(first), Some(second)) => {
            // Generations overflow after 2^32 writes.
            let is_second_later = second.generation.wrapping_sub(first.generation) <= u32::MAX / 2;
            match is_second_later {
                true => (second, 1),
                false => (first, 0),
            }
        }
        (Some(first), None) => (first, 0),
        (None, Some(second)) => (second, 1),
        (None, None) => return (Saved::default(), None),
    };
    let saved = Saved {
        generation: content.generation,
        next: slot ^ 1,
    };
    (saved, Some(content))
}

fn pack(index: u16, reading: Reading) -> [u8; READING_BYTES] {
    let [a, b] = index.to_le_bytes();
    let [[c, d, e, f], [g, h, i, j], [k, l, m, n]] = reading.brdf.map(f32::to_le_bytes);
    let saturated = u8::from(reading.saturated);
    [a, b, c, d, e, f, g, h, i, j, k, l, m, n, saturated]
}

fn unpack(record: &[u8; READING_BYTES]) -> (u16, Reading) {
    let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, saturated] = *record;
    let reading = Reading {
        brdf: [[c, d, e, f], [g, h, i, j], [k, l, m, n]].map(f32::from_le_bytes),
        saturated: saturated != 0,
    };
    (u16::from_le_bytes([a, b]), reading)
}
