//! A journal of items in two areas of a flash, one of which is active.
//!
//! Items are appended. When the area is full, the items that count are written to the other area. Its header, with a
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
use glimpse_core::checksum::crc_32;

use super::error::{Result, StoreError};

/// Bytes of an item: a multiple of every possible word, so no word is written twice.
pub(super) const BLOCK_BYTES: usize = 32;

/// Bytes of an item, as a distance of offsets.
const ITEM_BYTES: u32 = BLOCK_BYTES as u32;

/// Content of an item.
pub(super) type Content = [u8; 24];

/// A journal.
#[derive(Debug)]
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
    /// Finds the active one of two areas, and passes its items to `apply`.
    pub(super) fn mount(
        flash: &mut impl NorFlash,
        start: u32,
        area_bytes: u32,
        mut apply: impl FnMut(Content),
    ) -> Result<Self> {
        let mut areas = [(0, start), (0, start + area_bytes)];
        for (generation, area) in &mut areas {
            (_, *generation, _) = read(flash, *area)?;
        }
        areas.sort_unstable();
        let [(_, spare), (generation, active)] = areas;
        let end = active + area_bytes;
        let next = match generation {
            0 => end,
            _ => active + ITEM_BYTES,
        };
        let mut journal = Self {
            area_bytes,
            active,
            spare,
            generation,
            next,
        };
        for offset in (next..end).step_by(BLOCK_BYTES) {
            let (is_blank, item_generation, content) = read(flash, offset)?;
            if !is_blank {
                journal.next = offset + ITEM_BYTES;
            }
            if item_generation == generation {
                apply(content);
            }
        }
        Ok(journal)
    }

    /// Appends an item. If the area is full, writes `contents` to the other area instead. They include the item.
    ///
    /// After an error the content of the area is uncertain, so the next call writes to the other one.
    pub(super) fn append(
        &mut self,
        flash: &mut impl NorFlash,
        content: Content,
        contents: impl Iterator<Item = Content>,
    ) -> Result {
        let end = self.active + self.area_bytes;
        let mut offset = core::mem::replace(&mut self.next, end);
        if offset < end {
            write(flash, offset, self.generation, content)?;
            self.next = offset + ITEM_BYTES;
            return Ok(());
        }
        let (start, generation) = (self.spare, self.generation.saturating_add(1));
        let erased = flash.erase(start, start + self.area_bytes);
        erased.map_err(|_| StoreError::Flash)?;
        offset = start + ITEM_BYTES;
        for content in contents {
            write(flash, offset, generation, content)?;
            offset += ITEM_BYTES;
        }
        write(flash, start, generation, Content::default())?;
        core::mem::swap(&mut self.active, &mut self.spare);
        (self.generation, self.next) = (generation, offset);
        Ok(())
    }
}

/// Returns true if an item is blank, then its generation and its content. An invalid item has generation 0.
fn read(flash: &mut impl NorFlash, offset: u32) -> Result<(bool, u32, Content)> {
    let mut bytes = [0; BLOCK_BYTES];
    let result = flash.read(offset, &mut bytes);
    result.map_err(|_| StoreError::Flash)?;
    let [rest @ .., a, b, c, d] = &bytes;
    let [content @ .., e, f, g, h] = rest;
    let is_valid = crc_32(rest) == u32::from_le_bytes([*a, *b, *c, *d]);
    let generation = u32::from_le_bytes([*e, *f, *g, *h]);
    let is_blank = bytes == [0xFF; BLOCK_BYTES];
    Ok((is_blank, if is_valid { generation } else { 0 }, *content))
}

fn write(flash: &mut impl NorFlash, offset: u32, generation: u32, content: Content) -> Result {
    let mut bytes = [0; BLOCK_BYTES];
    let [to @ .., e, f, g, h, _, _, _, _] = &mut bytes;
    (*to, [*e, *f, *g, *h]) = (content, generation.to_le_bytes());
    let [rest @ .., a, b, c, d] = &mut bytes;
    [*a, *b, *c, *d] = crc_32(rest).to_le_bytes();
    flash.write(offset, &bytes).map_err(|_| StoreError::Flash)
}
