//! A reset at any byte of any write loses at most the reading that is being written.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{MIN_READING, Reading};
use glimpse_core::model::ModelKind;
use glimpse_core::scan::{Saved, Scan};
use proptest::prelude::*;

use crate::recipes::sgd;
use crate::scanning::{Any, empty_scans, new_scan, record, synthetic_reading};

const SLOT: usize = Saved::slot_bytes(8);
/// The order of the readings.
const ORDER: [u16; 8] = [5, 0, 7, 3, 1, 2, 6, 4];

/// Two slots of a flash, and their state in RAM.
#[derive(Clone)]
struct Flash {
    slots: [[u8; SLOT]; 2],
    saved: Saved,
}

impl Flash {
    fn blank(byte: u8) -> Self {
        let (slots, saved) = ([[byte; SLOT]; 2], Saved::default());
        Self { slots, saved }
    }

    /// Writes a scan's readings. The power fails after `cut` bytes, if they are fewer. `erase` is the content of the slot
    /// after its erasure, None for memory without erasure. Returns the length of the write.
    fn write(&mut self, scan: &Scan<'_, Any>, cut: usize, erase: Option<u8>) -> usize {
        let (slots, mut buffer) = (&mut self.slots, [0; SLOT]);
        let mut length = 0;
        let written = self.saved.write(scan, &mut buffer, |slot, bytes| {
            length = bytes.len();
            if let Some(byte) = erase {
                slots[slot].fill(byte);
            }
            let count = cut.min(length);
            slots[slot][..count].copy_from_slice(&bytes[..count]);
            match count == length {
                true => Ok(()),
                false => Err(Error::new(ErrorCode::BufferTooSmall)), // the error of a flash driver
            }
        });
        assert_eq!(written.is_err(), cut < length);
        length
    }

    /// Restores the readings into a new scan.
    fn restore(&mut self, scan: &mut Scan<'_, Any>) -> Result<usize, Error> {
        let slots = [self.slots[0].as_slice(), &self.slots[1]];
        let (saved, restored) = Saved::restore(slots, scan);
        assert_eq!(Saved::find(slots), saved);
        self.saved = saved;
        restored
    }
}

fn readings_of(scan: &Scan<'_, Any>) -> Vec<Option<Reading>> {
    let samples = scan.recipe().samples() as u16;
    (0..samples).map(|index| scan.reading(index)).collect()
}

/// Version 0.3 lost all readings at 116 of 123 cuts.
#[test]
fn reset_at_each_byte_loses_at_most_the_last_reading() {
    for mut scan in empty_scans() {
        let recipe = *scan.recipe();
        for erase in [None, Some(0xFF), Some(0), Some(0xA5)] {
            scan.restart();
            let mut flash = Flash::blank(erase.unwrap_or(0xFF));
            let mut cuts = 0;
            for index in ORDER {
                let before = readings_of(&scan);
                record(&mut scan, [index], synthetic_reading);
                let mut written = flash.clone();
                written.write(&scan, usize::MAX, erase);
                let mut cut = 0;
                loop {
                    let mut flash = flash.clone();
                    let length = flash.write(&scan, cut, erase);
                    let mut restored = new_scan::<Any>(recipe);
                    let count = flash.restore(&mut restored).unwrap_or(0);
                    // The last bytes may equal those that were there.
                    let expected = match flash.slots != written.slots {
                        true => &before,
                        false => &readings_of(&scan),
                    };
                    assert_eq!(&readings_of(&restored), expected, "cut after {cut}");
                    assert_eq!(count, expected.iter().flatten().count());
                    // The next write after such a reset goes to the damaged slot.
                    record(&mut restored, [index], synthetic_reading);
                    flash.write(&restored, 3, erase);
                    flash.restore(&mut new_scan(recipe)).unwrap_or(0);
                    let mut again = new_scan::<Any>(recipe);
                    assert_eq!(flash.restore(&mut again).unwrap_or(0), count);
                    if cut >= length {
                        break;
                    }
                    cut += 1;
                    cuts += 1;
                }
                flash.write(&scan, usize::MAX, erase);
            }
            assert!(cuts > 500, "{cuts}");
            // A failed write is repeated to the same slot.
            for cut in 0..20 {
                flash.write(&scan, cut, erase);
            }
            assert_eq!(flash.restore(&mut new_scan(recipe)), Ok(8));
        }
    }
}

#[test]
fn cleared_readings_stay_cleared() {
    let [mut scan, ..] = empty_scans();
    let mut flash = Flash::blank(0xFF);
    record(&mut scan, ORDER, synthetic_reading);
    for _ in 0..3 {
        flash.write(&scan, usize::MAX, None);
        let slots = &mut flash.slots;
        let cleared = flash.saved.clear(|slot, bytes| {
            slots[slot][..bytes.len()].copy_from_slice(bytes);
            Ok::<_, Error>(())
        });
        assert_eq!(cleared, Ok(()));
        let mut restored = new_scan(*scan.recipe());
        assert_eq!(flash.restore(&mut restored), Ok(0));
        assert_eq!(restored.pending().count(), 8);
    }
}

/// The latest write counts, even if it belongs to another recipe. Readings of this recipe then replace it.
#[test]
fn rejects_readings_of_other_recipe() {
    let mut other = sgd(ModelKind::Neural);
    other.pattern.expected_loss = Some(0.06);
    let mut other = new_scan(other.recipe());
    let [_, _, mut scan, _] = empty_scans();
    let mut flash = Flash::blank(0xFF);
    record(&mut scan, [2], synthetic_reading);
    flash.write(&scan, usize::MAX, None);
    let found = scan.recipe().checksum();
    let error = Error::with(ErrorCode::SavedRecipe, [found, 0]);
    assert_eq!(flash.restore(&mut other), Err(error));
    assert_eq!(other.pending().count(), 8);
    record(&mut other, [1, 3], synthetic_reading);
    flash.write(&other, usize::MAX, None);
    assert_eq!(flash.restore(&mut new_scan(*other.recipe())), Ok(2));
}

#[test]
fn unwritten_or_short_memory_is_damaged() {
    let [mut scan, ..] = empty_scans();
    for byte in [0, 0xFF, 0xA5] {
        let restored = Flash::blank(byte).restore(&mut scan);
        assert_eq!(restored, Err(Error::new(ErrorCode::SavedDamaged)));
    }
    for length in 0..20 {
        let (_, restored) = Saved::restore([&[0; 20][..length], &[]], &mut scan);
        assert_eq!(restored, Err(Error::new(ErrorCode::SavedDamaged)));
    }
    record(&mut scan, ORDER, synthetic_reading);
    for length in 0..SLOT {
        let written = Saved::default().write(&scan, &mut vec![0; length], |_, _| Ok(()));
        assert_eq!(written, Err(Error::new(ErrorCode::BufferTooSmall)));
    }
}

/// Bytes with a valid checksum whose readings cannot be recorded.
#[test]
fn rejects_invalid_saved_readings() {
    let [scan, ..] = empty_scans();
    let recipe = *scan.recipe();
    let restore = |index: u16, value: f32| {
        let mut bytes = recipe.checksum().to_le_bytes().to_vec();
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(2_u16.to_le_bytes());
        for (index, value) in [(4_u16, 0.2_f32), (index, value)] {
            bytes.extend(index.to_le_bytes());
            bytes.extend([0.1, value, 0.1].map(f32::to_le_bytes).concat());
            bytes.push(0);
        }
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
        bytes.extend(checksum.to_le_bytes());
        let mut scan = new_scan::<Any>(recipe);
        let (_, restored) = Saved::restore([&[], &bytes], &mut scan);
        assert_eq!(8 - scan.pending().count(), restored.unwrap_or(0));
        restored
    };
    assert_eq!(restore(2, 0.2), Ok(2));
    for (index, value, error) in [
        (2, f32::NAN, (ErrorCode::ReadingNonFinite, 1)),
        (2, f32::INFINITY, (ErrorCode::ReadingNonFinite, 1)),
        (2, MIN_READING.next_down(), (ErrorCode::ReadingNegative, 1)),
        (8, 0.2, (ErrorCode::ReadingIndex, 8)),
        (u16::MAX, 0.2, (ErrorCode::ReadingIndex, 8)),
    ] {
        let error = Error::with(error.0, [index.into(), error.1]);
        assert_eq!(restore(index, value), Err(error));
    }
}

proptest! {
    #[test]
    fn rejects_altered_readings(
        count in 0..=8_usize,
        index: prop::sample::Index,
        flip in 1..=255u8,
    ) {
        let [mut scan, ..] = empty_scans();
        record(&mut scan, ORDER.into_iter().take(count), synthetic_reading);
        let mut flash = Flash::blank(0xFF);
        let length = flash.write(&scan, usize::MAX, None);
        flash.slots[0][index.index(length)] ^= flip;
        prop_assert!(flash.restore(&mut new_scan(*scan.recipe())).is_err());
    }
}
