//! A scan with a power loss at any time resumes or restarts, and gives the same bits.

use glimpse_core::fit::Fitter;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{MIN_READING, Reading, ReadingError, Saved, SavedError};
use proptest::prelude::*;
use serde::Serialize;

use crate::recipes::{neural, parsed};
use crate::scanning::{
    Any, Outcome, empty_scans, fit, for_every_fitter, new_scan, recipe_for, record,
};

const BYTES: usize = Saved::<8>::BYTES;
/// The order of the readings.
const ORDER: [u16; 8] = [5, 0, 7, 3, 1, 2, 6, 4];

/// The reading of a sample of a material.
fn reading_of(material: f32, index: u16) -> Reading {
    let k = f32::from(index);
    Reading {
        brdf: [material + 0.1 * k, 0.3, 0.05 * k],
        saturated: index == 3,
    }
}

/// The first `count` readings of a material, saved.
fn saved(recipe: &Recipe<'_>, material: f32, count: usize) -> Saved<8> {
    let mut saved = Saved::new(recipe);
    for index in &ORDER[..count] {
        saved.insert(*index, reading_of(material, *index)).unwrap();
    }
    saved
}

/// Overwrites the first `length` bytes of `memory` with those of `saved`.
fn write_into(memory: &mut [u8; BYTES], saved: &Saved<8>, length: usize) {
    let mut buffer = [0; BYTES];
    let bytes = saved.write(&mut buffer).unwrap();
    let length = length.min(bytes.len());
    memory[..length].copy_from_slice(&bytes[..length]);
}

/// Runs a scan that begins with saved readings and takes the others. Returns its outcome and the number of readings
/// that it took.
fn resume<K: Fitter + 'static>(
    recipe: Recipe<'static>,
    saved: &[(u16, Reading)],
) -> (Outcome, usize) {
    let mut scan = new_scan::<K>(recipe);
    for (index, reading) in saved {
        scan.record(*index, *reading).unwrap();
    }
    let pending: Vec<u16> = scan.pending().map(|(index, _)| index).collect();
    let count = pending.len();
    record(&mut scan, pending, |index| reading_of(0.2, index));
    (fit(&mut scan, &[7]), count)
}

fn check_resumed_scan<K: Fitter + 'static>(recipe: Recipe<'static>) {
    let (uninterrupted, taken) = resume::<K>(recipe, &[]);
    assert_eq!(taken, 8);
    assert!(matches!(uninterrupted, Outcome::Fitted(..)));
    for count in 0..=8 {
        let resumed = resume::<K>(recipe, saved(&recipe, 0.2, count).readings());
        assert_eq!(resumed, (uninterrupted.clone(), 8 - count));
    }
}

#[test]
fn resumed_scan_keeps_result() {
    for_every_fitter!(check_resumed_scan);
}

/// Interrupts each write after each of its bytes. The first write replaces the readings of another material, and each
/// further one adds a reading.
#[test]
fn interrupted_write_leaves_old_new_or_no_readings() {
    for scan in empty_scans() {
        let recipe = *scan.recipe();
        let mut damaged = 0;
        let mut before = [0xA5; BYTES];
        let mut old = saved(&recipe, 0.7, 8);
        write_into(&mut before, &old, BYTES);
        for count in 0..=8 {
            let new = saved(&recipe, 0.2, count);
            for cut in 0..=BYTES {
                let mut memory = before;
                write_into(&mut memory, &new, cut);
                match Saved::<8>::read(&memory, &recipe) {
                    Ok(actual) if actual == new => {}
                    // Before the first byte that differs, memory holds the old readings.
                    Ok(actual) => assert_eq!((memory, &actual), (before, &old)),
                    Err(error) => {
                        assert_eq!(error, SavedError::Damaged);
                        damaged += 1;
                    }
                }
            }
            write_into(&mut before, &new, BYTES);
            old = new;
        }
        assert!(damaged > 300, "{damaged}");
    }
}

/// An interrupted fit starts again from the readings.
#[test]
fn power_loss_during_fit_keeps_result() {
    for mut scan in empty_scans() {
        let recipe = *scan.recipe();
        let uninterrupted = resume::<Any>(recipe, &[]).0;
        let complete = saved(&recipe, 0.2, 8);
        let mut memory = [0; BYTES];
        write_into(&mut memory, &complete, BYTES);
        for done in [1, 3, 7, 8, 100, 159] {
            record(&mut scan, 0..8, |index| reading_of(0.2, index));
            let mut fit = scan.fit().unwrap();
            let done = done.min(fit.progress().total - 1);
            assert_eq!(fit.advance(done).done, done);
            // After the power loss, only `memory` remains.
            let actual = Saved::<8>::read(&memory, &recipe).unwrap();
            let resumed = resume::<Any>(recipe, actual.readings());
            assert_eq!(resumed, (uninterrupted.clone(), 0));
        }
    }
}

#[test]
fn rejects_readings_of_other_recipe() {
    let recipe = recipe_for(ModelKind::Neural);
    let mut other = neural();
    other.expected_loss *= 2.0;
    let other = parsed(other.write().unwrap());
    let mut memory = [0; BYTES];
    write_into(&mut memory, &saved(&recipe, 0.2, 5), BYTES);
    let found = recipe.checksum();
    let actual = Saved::<8>::read(&memory, &other);
    assert_eq!(actual, Err(SavedError::Recipe { found }));
}

#[test]
fn unwritten_memory_is_damaged() {
    let recipe = recipe_for(ModelKind::Neural);
    for byte in [0, 0xFF, 0xA5] {
        let actual = Saved::<8>::read(&[byte; BYTES], &recipe);
        assert_eq!(actual, Err(SavedError::Damaged));
    }
    for length in 0..6 {
        assert!(Saved::<8>::read(&[0; 6][..length], &recipe).is_err());
    }
}

#[test]
fn capacity_is_enforced() {
    let recipe = recipe_for(ModelKind::Neural);
    let mut saved = saved(&recipe, 0.2, 8);
    assert_eq!(saved.insert(8, reading_of(0.2, 8)), Err(SavedError::Full));
    let needed = saved.write(&mut [0; BYTES]).unwrap().len();
    for length in 0..needed {
        let actual = saved.write(&mut vec![0; length]).err();
        assert_eq!(actual, Some(SavedError::Full));
    }
    assert!(saved.write(&mut vec![0; needed]).is_ok());
    // Readings of a firmware with more capacity count as damaged.
    let mut memory = [0; BYTES];
    write_into(&mut memory, &saved, BYTES);
    let actual = Saved::<7>::read(&memory, &recipe);
    assert_eq!(actual, Err(SavedError::Damaged));
    saved.clear();
    assert_eq!(saved, Saved::new(&recipe));
}

/// A second reading of a sample replaces the first, even at full capacity.
#[test]
fn second_reading_replaces_first() {
    let recipe = recipe_for(ModelKind::Neural);
    let mut saved = saved(&recipe, 0.2, 8);
    saved.insert(7, reading_of(0.9, 7)).unwrap();
    let expected = ORDER.map(|index| {
        let material = if index == 7 { 0.9 } else { 0.2 };
        (index, reading_of(material, index))
    });
    assert_eq!(saved.readings(), expected);
}

/// In version 0.1, a NaN was accepted, saved and read.
#[test]
fn rejects_invalid_saved_readings() {
    /// The layout of `Saved`, without its checks.
    #[derive(Serialize)]
    struct Forged {
        recipe: u32,
        readings: Vec<(u16, Reading)>,
    }
    let recipe = recipe_for(ModelKind::Neural);
    let read = |reading: Reading| {
        let forged = Forged {
            recipe: recipe.checksum(),
            readings: vec![(4, reading_of(0.2, 4)), (2, reading)],
        };
        let mut buffer = [0; BYTES];
        let length = postcard::to_slice(&forged, &mut buffer).unwrap().len();
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        let checksum = crc.checksum(&buffer[..length]).to_le_bytes();
        buffer[length..length + 4].copy_from_slice(&checksum);
        Saved::<8>::read(&buffer, &recipe)
    };
    assert_eq!(read(reading_of(0.2, 2)).unwrap().readings().len(), 2);
    for (value, error) in [
        (f32::NAN, ReadingError::NonFinite(1)),
        (f32::INFINITY, ReadingError::NonFinite(1)),
        (MIN_READING.next_down(), ReadingError::Negative(1)),
    ] {
        let reading = Reading::new([0.1, value, 0.1]);
        let mut saved = saved(&recipe, 0.2, 3);
        let before = saved.clone();
        assert_eq!(saved.insert(1, reading), Err(SavedError::Reading(error)));
        assert_eq!(saved.insert(0, reading), Err(SavedError::Reading(error)));
        assert_eq!(saved, before);
        assert_eq!(read(reading), Err(SavedError::Reading(error)));
    }
}

proptest! {
    #[test]
    fn saved_readings_round_trip(
        values in prop::collection::vec(
            (any::<u16>(), prop::array::uniform3(-1.0..1e9_f32), any::<bool>()),
            0..=8,
        ),
    ) {
        let recipe = recipe_for(ModelKind::Neural);
        let mut saved = Saved::<8>::new(&recipe);
        for (index, brdf, saturated) in values {
            saved.insert(index, Reading { brdf, saturated }).unwrap();
        }
        let mut memory = [0x5A; BYTES];
        write_into(&mut memory, &saved, BYTES);
        prop_assert_eq!(Saved::read(&memory, &recipe), Ok(saved));
    }

    #[test]
    fn rejects_altered_readings(
        count in 0..=8_usize,
        index: prop::sample::Index,
        flip in 1..=255u8,
    ) {
        let recipe = recipe_for(ModelKind::Neural);
        let mut buffer = [0; BYTES];
        let length = saved(&recipe, 0.2, count).write(&mut buffer).unwrap().len();
        buffer[index.index(length)] ^= flip;
        prop_assert!(Saved::<8>::read(&buffer, &recipe).is_err());
    }
}
