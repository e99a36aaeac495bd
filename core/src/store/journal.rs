//! A journal of items in two areas of a flash, one of which is active.
//!
//! Items are appended. When the area is full, the items that count are copied to the other area. Its header, with a
//! larger generation, is written last. An area is erased before each use.
//!
//! | bytes of an area | content |
//! |---|---|
//! | 0..32 | header: an item of zeros |
//! | 32 k.. | items |
//!
//! | bytes of an item | content |
//! |---|---|
//! | 0..24 | content in postcard's format |
//! | 24..28 | generation of its area, little-endian |
//! | 28..32 | CRC-32 (ISO-HDLC) of bytes 0..28 |
//!
//! A power cut may leave anything of an interrupted write or erase. Items with a wrong checksum or generation are
//! therefore ignored.
//!
//! The crate `sequential-storage` 8.0.2 was measured in the same way, with 200 writes of nine items in four sectors and
//! words of 4 bytes. It kept all items after 53,125 cuts in writes and 4,617 cuts in erases from low to high addresses.
//! After an erase from high to low it lost all items, or refused further writes, in 1,533 of 4,617 cuts; after partial
//! erases of random bits in 45 of 576. Flash memories do not specify the order.

use embedded_storage::nor_flash::NorFlash;

use crate::checksum::crc_32;
use crate::error::{Error, ErrorCode};

/// Bytes of an item: a multiple of every possible word, so no word is written twice.
pub(super) const ITEM_BYTES: u32 = 32;

/// Content of an item.
pub(super) type Content = [u8; 24];

const FAULT: Error = Error::new(ErrorCode::Storage);

/// A journal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Journal {
    area_bytes: u32,
    /// Offset of the active area.
    active: u32,
    /// Offset of the other area.
    spare: u32,
    /// Generation of the active area; 0 before the first write.
    generation: u32,
    /// Offset of the next item in the active area. At its end, the area is full.
    next: u32,
}

impl Journal {
    /// Finds the active one of two areas, and the end of its items.
    pub(super) fn mount(
        flash: &mut impl NorFlash,
        start: u32,
        area_bytes: u32,
    ) -> Result<Self, Error> {
        let second = start.saturating_add(area_bytes);
        let mut areas = [(0, start), (0, second)];
        for (generation, area) in &mut areas {
            (_, *generation, _) = read(flash, *area)?;
        }
        areas.sort_unstable();
        let [(_, spare), (generation, active)] = areas;
        let end = active.saturating_add(area_bytes);
        let mut journal = Self {
            area_bytes,
            active,
            spare,
            generation,
            next: end,
        };
        if generation > 0 {
            // Blank items are at the end only.
            journal.next = first(active);
            for offset in journal.offsets(end) {
                if !read(flash, offset)?.0 {
                    journal.next = offset.saturating_add(ITEM_BYTES);
                }
            }
        }
        Ok(journal)
    }

    /// Returns the offsets of the active area's items before `end`.
    fn offsets(&self, end: u32) -> impl Iterator<Item = u32> + use<> {
        (first(self.active)..end).step_by(ITEM_BYTES as usize)
    }

    /// Passes the content of all items, in their order.
    pub(super) fn read_all(
        &self,
        flash: &mut impl NorFlash,
        mut apply: impl FnMut(&Content),
    ) -> Result<(), Error> {
        for offset in self.offsets(self.active.saturating_add(self.area_bytes)) {
            let (_, generation, content) = read(flash, offset)?;
            if generation > 0 && generation == self.generation {
                apply(&content);
            }
        }
        Ok(())
    }

    /// Appends an item. Returns false if the area is full: then [`Journal::copy`] makes room.
    ///
    /// After an error the content of the area is uncertain, so it is full.
    pub(super) fn append(
        &mut self,
        flash: &mut impl NorFlash,
        content: &Content,
    ) -> Result<bool, Error> {
        let end = self.active.saturating_add(self.area_bytes);
        let offset = core::mem::replace(&mut self.next, end);
        if offset >= end {
            return Ok(false);
        }
        write(flash, offset, self.generation, content)?;
        self.next = offset.saturating_add(ITEM_BYTES);
        Ok(true)
    }

    /// Erases the other area and writes items to it, which becomes the active one: those that `item` returns for the
    /// numbers below `candidates`, from the journal before the copy.
    pub(super) fn copy<F: NorFlash>(
        &mut self,
        flash: &mut F,
        candidates: u32,
        mut item: impl FnMut(&mut F, &Self, u32) -> Result<Option<Content>, Error>,
    ) -> Result<(), Error> {
        let (start, generation) = (self.spare, self.generation.saturating_add(1));
        let end = start.saturating_add(self.area_bytes);
        flash.erase(start, end).map_err(|_| FAULT)?;
        let mut offset = first(start);
        for number in 0..candidates {
            if let Some(content) = item(flash, self, number)? {
                write(flash, offset, generation, &content)?;
                offset = offset.saturating_add(ITEM_BYTES);
            }
        }
        write(flash, start, generation, &Content::default())?;
        core::mem::swap(&mut self.active, &mut self.spare);
        (self.generation, self.next) = (generation, offset);
        Ok(())
    }
}

/// Returns the offset of the first item of an area.
fn first(area: u32) -> u32 {
    area.saturating_add(ITEM_BYTES)
}

/// Returns true if an item is blank, then its generation and its content. An invalid item has generation 0.
fn read(flash: &mut impl NorFlash, offset: u32) -> Result<(bool, u32, Content), Error> {
    let mut bytes = [0; ITEM_BYTES as usize];
    flash.read(offset, &mut bytes).map_err(|_| FAULT)?;
    let [rest @ .., a, b, c, d] = &bytes;
    let [content @ .., e, f, g, h] = rest;
    let is_valid = crc_32(rest) == u32::from_le_bytes([*a, *b, *c, *d]);
    let generation = u32::from_le_bytes([*e, *f, *g, *h]);
    let is_blank = bytes == [0xFF; ITEM_BYTES as usize];
    Ok((is_blank, if is_valid { generation } else { 0 }, *content))
}

fn write(
    flash: &mut impl NorFlash,
    offset: u32,
    generation: u32,
    content: &Content,
) -> Result<(), Error> {
    let mut bytes = [0; ITEM_BYTES as usize];
    let [to @ .., e, f, g, h, _, _, _, _] = &mut bytes;
    (*to, [*e, *f, *g, *h]) = (*content, generation.to_le_bytes());
    let [rest @ .., a, b, c, d] = &mut bytes;
    [*a, *b, *c, *d] = crc_32(rest).to_le_bytes();
    flash.write(offset, &bytes).map_err(|_| FAULT)
}
