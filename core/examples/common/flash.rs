// A flash in memory whose power can be cut, for examples and tests.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// The length of a sector.
pub const SECTOR_BYTES: usize = 512;

/// Effect of a power cut on the interrupted write or erase.
#[derive(Clone, Copy, Debug)]
pub enum Effect {
    /// This number of bytes was changed, from low to high addresses.
    Low(usize),
    /// This number of bytes was changed, from high to low addresses.
    High(usize),
    /// A random subset of the bits was changed; the value is the seed.
    Bits(u64),
}

/// Returns the effects on a change of `length` bytes: cuts at each byte in both orders, and random bits.
#[allow(dead_code)] // of tests of the store
pub fn effects(length: usize) -> impl Iterator<Item = Effect> {
    let orders = (0..=length).flat_map(|count| [Effect::Low(count), Effect::High(count)]);
    orders.chain((0..16).map(Effect::Bits))
}

/// A flash with words of 32 bytes. A write clears bits, an erase sets them.
#[derive(Clone, Debug)]
pub struct Flash {
    /// Its content.
    pub bytes: Vec<u8>,
    /// Lengths of the writes and erases of sectors until now.
    pub changes: Vec<usize>,
    /// Number of changes before a failed one, and the effect on that.
    pub cut: Option<(usize, Effect)>,
}

impl Flash {
    /// Returns an erased flash.
    pub fn new(sectors: usize) -> Self {
        Self {
            bytes: vec![0xFF; sectors * SECTOR_BYTES],
            changes: Vec::new(),
            cut: None,
        }
    }

    fn is_off(&self) -> bool {
        self.cut.is_some_and(|(cut, _)| self.changes.len() > cut)
    }

    fn change(&mut self, from: usize, after: &[u8]) -> Result<(), NorFlashErrorKind> {
        if self.is_off() {
            return Err(NorFlashErrorKind::Other);
        }
        let (number, length) = (self.changes.len(), after.len());
        self.changes.push(length);
        let effect = self.cut.filter(|(cut, _)| *cut == number);
        let place = self.bytes[from..from + length].iter_mut();
        for ((at, before), after) in place.enumerate().zip(after) {
            let mask = match effect {
                Some((_, Effect::Low(count))) if at >= count => 0,
                Some((_, Effect::High(count))) if at + count < length => 0,
                Some((_, Effect::Bits(seed))) => {
                    let hash = (seed + 99 * at as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                    (hash >> 56) as u8
                }
                _ => 0xFF,
            };
            *before = *before & !mask | after & mask;
        }
        effect.map_or(Ok(()), |_| Err(NorFlashErrorKind::Other))
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 32;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let range = offset as usize..offset as usize + bytes.len();
        assert!(range.start.is_multiple_of(32) && range.end.is_multiple_of(32));
        let found = self.bytes.get(range).filter(|_| !self.is_off());
        bytes.copy_from_slice(found.ok_or(NorFlashErrorKind::Other)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(SECTOR_BYTES) && to.is_multiple_of(SECTOR_BYTES));
        let mut sectors = (from..to).step_by(SECTOR_BYTES);
        sectors.try_for_each(|sector| self.change(sector, &[0xFF; SECTOR_BYTES]))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let range = offset as usize..offset as usize + bytes.len();
        assert!(range.start.is_multiple_of(32) && range.end.is_multiple_of(32));
        // Words with error correction can be written only once.
        let is_blank = self.bytes[range.clone()].iter().all(|byte| *byte == 0xFF);
        assert!(is_blank || self.is_off());
        self.change(range.start, bytes)
    }
}
