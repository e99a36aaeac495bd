//! A journal of numbered items in two areas of a flash, of which one is in force.
//!
//! Items are appended; of several with one number the last one counts. When the area is full, what
//! counts is copied to the other one, whose header, with a larger generation, is written last.
//!
//! | bytes of an area | content |
//! |---|---|
//! | 0..32 | header: an item whose number is [`HEADER`] and whose content is zero |
//! | 32 k.. | items |
//!
//! | bytes of an item | content |
//! |---|---|
//! | 0..2 | number, little-endian |
//! | 2..6 | generation of its area |
//! | 6..28 | content |
//! | 28..32 | CRC-32 (ISO-HDLC) of all that |
//!
//! Nothing is relied on about what a power cut leaves of a write or an erase: what has no right
//! checksum and generation is not there, and an area is erased anew before it is used. (Of
//! `sequential-storage` 8.0 the same tests lost all readings if an erase was cut that does not go
//! from low to high addresses, in 32 of 4856 cuts.)

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::checksum::crc_32;

use super::{MAX_WORD_BYTES, StoreError, word_bytes};

/// Bytes of an item: a multiple of every flash's word, so that no word is written twice.
const ITEM_BYTES: usize = MAX_WORD_BYTES;
/// Bytes of an item's content.
pub(super) const CONTENT_BYTES: usize = 22;
/// The number of an area's header; no item has it.
const HEADER: u16 = u16::MAX;

/// What an item holds.
pub(super) type Content = [u8; CONTENT_BYTES];

/// A journal.
#[derive(Clone, Debug)]
pub(super) struct Journal {
    areas: [Range<u32>; 2],
    /// Which area is in force, and its generation; None before anything was written.
    in_force: Option<(usize, u32)>,
    /// Where the next item goes: an address in that area.
    next: u32,
}

impl Journal {
    /// Finds the area in force and its end.
    pub(super) fn mount<F: NorFlash>(
        flash: &mut F,
        areas: [Range<u32>; 2],
    ) -> Result<Self, StoreError> {
        let _ = word_bytes::<F>(); // items are whole words of every flash that this lets through
        let mut journal = Self {
            areas,
            in_force: None,
            next: 0,
        };
        for area in 0..journal.areas.len() {
            let Some((HEADER, generation, _)) = read(flash, journal.area(area).start)? else {
                continue;
            };
            let older = |(_, other): (usize, u32)| generation.wrapping_sub(other) > u32::MAX / 2;
            if !journal.in_force.is_some_and(older) {
                journal.in_force = Some((area, generation));
            }
        }
        if let Some((area, _)) = journal.in_force {
            journal.next = journal.end(flash, area)?;
        }
        Ok(journal)
    }

    /// The content of the last item of this number.
    #[inline(never)] // smaller: there are several calls
    pub(super) fn get<F: NorFlash>(
        &self,
        flash: &mut F,
        number: u16,
    ) -> Result<Option<Content>, StoreError> {
        let Some((area, generation)) = self.in_force else {
            return Ok(None);
        };
        let first = self.area(area).start.saturating_add(ITEM_BYTES as u32);
        for place in (first..self.next).step_by(ITEM_BYTES).rev() {
            match read(flash, place)? {
                Some((found, of, content)) if (found, of) == (number, generation) => {
                    return Ok(Some(content));
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// Appends an item. If there is no room any more, those of `numbers` are kept, and all others
    /// forgotten.
    pub(super) fn put<F: NorFlash>(
        &mut self,
        flash: &mut F,
        number: u16,
        content: &Content,
        numbers: impl Iterator<Item = u16>,
    ) -> Result<(), StoreError> {
        let (area, generation) = match self.in_force {
            Some((area, generation)) if self.next < self.area(area).end => (area, generation),
            _ => self.turn_over(flash, numbers)?,
        };
        if self.next >= self.area(area).end {
            return Err(StoreError::Full);
        }
        let place = self.next;
        self.next = place.saturating_add(ITEM_BYTES as u32);
        write(flash, place, number, generation, content)
    }

    /// Copies what counts to the other area, and puts that in force.
    fn turn_over<F: NorFlash>(
        &mut self,
        flash: &mut F,
        numbers: impl Iterator<Item = u16>,
    ) -> Result<(usize, u32), StoreError> {
        let (area, generation) = match self.in_force {
            Some((area, generation)) => (1 - area.min(1), generation.wrapping_add(1)),
            None => (0, 1),
        };
        let Range { start, end } = self.area(area);
        flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        let mut place = start.saturating_add(ITEM_BYTES as u32);
        for number in numbers {
            if let Some(content) = self.get(flash, number)? {
                if place >= end {
                    return Err(StoreError::Full);
                }
                write(flash, place, number, generation, &content)?;
                place = place.saturating_add(ITEM_BYTES as u32);
            }
        }
        write(flash, start, HEADER, generation, &[0; CONTENT_BYTES])?;
        self.in_force = Some((area, generation));
        self.next = place;
        Ok((area, generation))
    }

    /// Behind the last item that is not blank.
    fn end<F: NorFlash>(&self, flash: &mut F, area: usize) -> Result<u32, StoreError> {
        let Range { start, end } = self.area(area);
        for place in (start..end).step_by(ITEM_BYTES).rev() {
            if bytes(flash, place)? != [0xFF; ITEM_BYTES] {
                return Ok(place.saturating_add(ITEM_BYTES as u32));
            }
        }
        Ok(start)
    }

    fn area(&self, area: usize) -> Range<u32> {
        self.areas.get(area).cloned().unwrap_or_default()
    }
}

fn bytes<F: NorFlash>(flash: &mut F, place: u32) -> Result<[u8; ITEM_BYTES], StoreError> {
    let mut bytes = [0; ITEM_BYTES];
    flash
        .read(place, &mut bytes)
        .map_err(|_| StoreError::Flash)?;
    Ok(bytes)
}

/// The item at an address, if a whole one is there: number, generation and content.
fn read<F: NorFlash>(flash: &mut F, place: u32) -> Result<Option<(u16, u32, Content)>, StoreError> {
    Ok(parse(&bytes(flash, place)?))
}

fn parse(bytes: &[u8; ITEM_BYTES]) -> Option<(u16, u32, Content)> {
    let (rest, checksum) = bytes.split_last_chunk()?;
    if crc_32(rest) != u32::from_le_bytes(*checksum) {
        return None;
    }
    let (number, rest) = rest.split_first_chunk()?;
    let (generation, rest) = rest.split_first_chunk()?;
    let number = u16::from_le_bytes(*number);
    Some((
        number,
        u32::from_le_bytes(*generation),
        *rest.first_chunk()?,
    ))
}

fn write<F: NorFlash>(
    flash: &mut F,
    place: u32,
    number: u16,
    generation: u32,
    content: &Content,
) -> Result<(), StoreError> {
    let mut bytes = [0; ITEM_BYTES];
    let head = number
        .to_le_bytes()
        .into_iter()
        .chain(generation.to_le_bytes());
    for (to, from) in bytes.iter_mut().zip(head.chain(*content)) {
        *to = from;
    }
    if let Some((rest, checksum)) = bytes.split_last_chunk_mut() {
        *checksum = crc_32(rest).to_le_bytes();
    }
    flash.write(place, &bytes).map_err(|_| StoreError::Flash)
}
