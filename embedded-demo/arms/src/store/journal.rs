//! A journal of numbered items in two areas of a flash, one of which is active.
//!
//! Items are appended. The last item of each number counts. When the area is full, the items that count are copied to
//! the other area. Its header, with a larger generation, is written last.
//!
//! | bytes of an area | content |
//! |---|---|
//! | 0..32 | header: an item with the number [`HEADER`] and zeros as content |
//! | 32 k.. | items |
//!
//! | bytes of an item | content |
//! |---|---|
//! | 0..2 | number, little-endian |
//! | 2..6 | generation of its area |
//! | 6..28 | content |
//! | 28..32 | CRC-32 (ISO-HDLC) of bytes 0..28 |
//!
//! A power cut may leave anything of an interrupted write or erase. Items with a wrong checksum or generation are
//! therefore ignored, and an area is erased again before it is used. (`sequential-storage` 8.0 lost all readings in
//! these tests in 32 of 4856 cuts, if an interrupted erase does not proceed from low to high addresses.)

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use glimpse_core::checksum::crc_32;

use super::{MAX_WORD_BYTES, StoreError, word_bytes};

/// Bytes of an item: a multiple of every possible word, so no word is written twice.
const ITEM_BYTES: usize = MAX_WORD_BYTES;
/// Bytes of the content of an item.
pub(super) const CONTENT_BYTES: usize = 22;
/// Number of an area's header. No item has this number.
const HEADER: u16 = u16::MAX;

/// Content of an item.
pub(super) type Content = [u8; CONTENT_BYTES];

/// A journal.
#[derive(Clone, Debug)]
pub(super) struct Journal {
    areas: [Range<u32>; 2],
    /// The active area and its generation; None before the first write.
    active: Option<(usize, u32)>,
    /// Address of the next item, in the active area.
    next: u32,
}

impl Journal {
    /// Finds the active area and its end.
    pub(super) fn mount<F: NorFlash>(
        flash: &mut F,
        areas: [Range<u32>; 2],
    ) -> Result<Self, StoreError> {
        let _ = word_bytes::<F>(); // checks at compile time that items are whole words
        let mut journal = Self {
            areas,
            active: None,
            next: 0,
        };
        for area in 0..journal.areas.len() {
            let Some((HEADER, generation, _)) = read(flash, journal.area(area).start)? else {
                continue;
            };
            let is_older = |(_, other): (usize, u32)| generation.wrapping_sub(other) > u32::MAX / 2;
            if !journal.active.is_some_and(is_older) {
                journal.active = Some((area, generation));
            }
        }
        if let Some((area, _)) = journal.active {
            journal.next = journal.end(flash, area)?;
        }
        Ok(journal)
    }

    /// Returns the content of the last item of this number.
    #[inline(never)] // saves flash: one copy for several calls
    pub(super) fn get<F: NorFlash>(
        &self,
        flash: &mut F,
        number: u16,
    ) -> Result<Option<Content>, StoreError> {
        let Some((area, generation)) = self.active else {
            return Ok(None);
        };
        let first = self.area(area).start.saturating_add(ITEM_BYTES as u32);
        for address in (first..self.next).step_by(ITEM_BYTES).rev() {
            match read(flash, address)? {
                Some((number_at, generation_at, content))
                    if (number_at, generation_at) == (number, generation) =>
                {
                    return Ok(Some(content));
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// Appends an item. If the area is full, only the items of `numbers` are kept.
    pub(super) fn put<F: NorFlash>(
        &mut self,
        flash: &mut F,
        number: u16,
        content: &Content,
        numbers: impl Iterator<Item = u16>,
    ) -> Result<(), StoreError> {
        let (area, generation) = match self.active {
            Some((area, generation)) if self.next < self.area(area).end => (area, generation),
            _ => self.compact(flash, numbers)?,
        };
        if self.next >= self.area(area).end {
            return Err(StoreError::Full);
        }
        let address = self.next;
        self.next = address.saturating_add(ITEM_BYTES as u32);
        write(flash, address, number, generation, content)
    }

    /// Copies the items of `numbers` to the other area, and activates it.
    fn compact<F: NorFlash>(
        &mut self,
        flash: &mut F,
        numbers: impl Iterator<Item = u16>,
    ) -> Result<(usize, u32), StoreError> {
        let (area, generation) = match self.active {
            Some((area, generation)) => (1 - area.min(1), generation.wrapping_add(1)),
            None => (0, 1),
        };
        let Range { start, end } = self.area(area);
        flash.erase(start, end).map_err(|_| StoreError::Flash)?;
        let mut address = start.saturating_add(ITEM_BYTES as u32);
        for number in numbers {
            if let Some(content) = self.get(flash, number)? {
                if address >= end {
                    return Err(StoreError::Full);
                }
                write(flash, address, number, generation, &content)?;
                address = address.saturating_add(ITEM_BYTES as u32);
            }
        }
        write(flash, start, HEADER, generation, &[0; CONTENT_BYTES])?;
        self.active = Some((area, generation));
        self.next = address;
        Ok((area, generation))
    }

    /// Returns the address after the last item that is not blank.
    fn end<F: NorFlash>(&self, flash: &mut F, area: usize) -> Result<u32, StoreError> {
        let Range { start, end } = self.area(area);
        for address in (start..end).step_by(ITEM_BYTES).rev() {
            if bytes(flash, address)? != [0xFF; ITEM_BYTES] {
                return Ok(address.saturating_add(ITEM_BYTES as u32));
            }
        }
        Ok(start)
    }

    fn area(&self, area: usize) -> Range<u32> {
        self.areas.get(area).cloned().unwrap_or_default()
    }
}

fn bytes<F: NorFlash>(flash: &mut F, address: u32) -> Result<[u8; ITEM_BYTES], StoreError> {
    let mut bytes = [0; ITEM_BYTES];
    flash
        .read(address, &mut bytes)
        .map_err(|_| StoreError::Flash)?;
    Ok(bytes)
}

/// Returns the valid item at an address, if there is one: number, generation and content.
fn read<F: NorFlash>(
    flash: &mut F,
    address: u32,
) -> Result<Option<(u16, u32, Content)>, StoreError> {
    Ok(parse(&bytes(flash, address)?))
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
    address: u32,
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
    flash.write(address, &bytes).map_err(|_| StoreError::Flash)
}
