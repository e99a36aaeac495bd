//! A scan that loses power anywhere goes on where it was or begins afresh, and ends in the same bits.

use glimpse_core::fit::Fitter;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LEAST_READING, Memory, Reading, ReadingError, Saved, SavedError, Scan};
use proptest::prelude::*;
use serde::Serialize;

use super::common::{neural, write};
use super::scanning::{Outcome, SAMPLES, every_fitter, fit, recipe_of};

const BYTES: usize = Saved::<8>::BYTES;
/// The order in which samples are read.
const ORDER: [u16; 8] = [5, 0, 7, 3, 1, 2, 6, 4];

/// What the sensor sees at a sample of the pattern.
fn seen(material: f32, index: u16) -> Reading {
    let k = f32::from(index);
    Reading {
        brdf: [material + 0.1 * k, 0.3, 0.05 * k],
        saturated: index == 3,
    }
}

/// What is saved of a scan of this material that has come so far.
fn saved(recipe: &Recipe<'_>, material: f32, taken: usize) -> Saved<8> {
    let mut saved = Saved::new(recipe);
    for index in &ORDER[..taken] {
        saved.insert(*index, seen(material, *index)).unwrap();
    }
    saved
}

/// Memory that holds what is written, after whatever was there.
fn write_into(memory: &mut [u8; BYTES], saved: &Saved<8>, cut: usize) {
    let mut buffer = [0; BYTES];
    let bytes = saved.write(&mut buffer).unwrap();
    let cut = cut.min(bytes.len());
    memory[..cut].copy_from_slice(&bytes[..cut]);
}

/// What comes of a scan that begins with what is saved and reads the rest; and how many it had to
/// read.
fn go_on<K: Fitter>(recipe: Recipe<'_>, saved: &[(u16, Reading)]) -> (Outcome, usize) {
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for (index, reading) in saved {
        scan.record(*index, *reading).unwrap();
    }
    let mut taken = 0;
    while let Some((index, _)) = scan.next_pending() {
        scan.record(index, seen(0.2, index)).unwrap();
        taken += 1;
    }
    (fit(&mut scan, &[7]), taken)
}

/// Power is lost after each byte of each write in turn: of the scan's own, and of the one that
/// forgets the scan before it, of another material.
fn power_is_lost_at_any_byte<K: Fitter>(recipe: Recipe<'_>) {
    let (whole, all) = go_on::<K>(recipe, &[]);
    assert_eq!(all, 8);
    assert!(matches!(whole, Outcome::Fitted(..)));

    // Which results are right, by how many readings outlast.
    for kept in 0..=8 {
        let resumed = go_on::<K>(recipe, saved(&recipe, 0.2, kept).readings());
        assert_eq!(resumed, (whole.clone(), 8 - kept));
    }

    let mut cuts = 0;
    let mut damaged = 0;
    let mut before = [0xA5; BYTES];
    write_into(&mut before, &saved(&recipe, 0.7, 8), BYTES);
    for taken in 0..=8 {
        let after = saved(&recipe, 0.2, taken);
        for cut in 0..=BYTES {
            let mut memory = before;
            write_into(&mut memory, &after, cut);
            cuts += 1;
            match Saved::<8>::read(&memory, &recipe) {
                Ok(found) if found == after => {}
                // Not a byte was altered yet.
                Ok(found) => {
                    assert_eq!(memory, before);
                    let old = match taken {
                        0 => saved(&recipe, 0.7, 8),
                        taken => saved(&recipe, 0.2, taken - 1),
                    };
                    assert_eq!(found, old);
                }
                Err(error) => {
                    assert_eq!(error, SavedError::Damaged);
                    damaged += 1;
                }
            }
        }
        write_into(&mut before, &after, BYTES);
    }
    assert_eq!(cuts, 9 * (BYTES + 1));
    assert!(damaged > 300, "{damaged}");
}

#[test]
fn power_lost_at_any_byte_of_any_write_ends_in_the_same_bits() {
    every_fitter!(power_is_lost_at_any_byte);
}

/// A fit cut short begins again from the readings.
#[test]
fn power_lost_in_the_middle_of_a_fit_ends_in_the_same_bits() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let (whole, _) = go_on::<K>(recipe, &[]);
        let kept = saved(&recipe, 0.2, 8);
        for done in [1, 3, 7, 8, 100, 159] {
            let mut memory = Memory::<K, SAMPLES>::new();
            let mut scan = Scan::new(recipe, &mut memory).unwrap();
            for (index, reading) in kept.readings() {
                scan.record(*index, *reading).unwrap();
            }
            let mut fit = scan.fit().unwrap();
            let done = done.min(fit.progress().total - 1);
            assert_eq!(fit.advance(done).done, done);
            drop(memory); // all that it had learned is lost
            let mut memory = [0; BYTES];
            write_into(&mut memory, &kept, BYTES);
            let found = Saved::<8>::read(&memory, &recipe).unwrap();
            assert_eq!(go_on::<K>(recipe, found.readings()), (whole.clone(), 0));
        }
    }
    every_fitter!(check);
}

#[test]
fn readings_by_another_recipe_are_refused_by_name() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut other = neural();
    other.expected_loss *= 2.0;
    let other = write(&other).unwrap();
    let other = Recipe::parse(&other).unwrap();
    let mut memory = [0; BYTES];
    write_into(&mut memory, &saved(&recipe, 0.2, 5), BYTES);
    let found = recipe.checksum();
    let refused = Saved::<8>::read(&memory, &other);
    assert_eq!(refused, Err(SavedError::Recipe { found }));
}

#[test]
fn memory_that_nobody_wrote_holds_no_readings() {
    let bytes = recipe_of(ModelKind::Neural);
    let recipe = Recipe::parse(&bytes).unwrap();
    for memory in [[0; BYTES], [0xFF; BYTES], [0xA5; BYTES]] {
        let refused = Saved::<8>::read(&memory, &recipe);
        assert_eq!(refused, Err(SavedError::Damaged));
    }
    for length in 0..6 {
        assert!(Saved::<8>::read(&[0; 6][..length], &recipe).is_err());
    }
}

#[test]
fn there_is_room_for_the_capacity_and_no_more() {
    let bytes = recipe_of(ModelKind::Neural);
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut saved = saved(&recipe, 0.2, 8);
    assert_eq!(saved.insert(8, seen(0.2, 8)), Err(SavedError::Full));
    let needed = saved.write(&mut [0; BYTES]).unwrap().len();
    for length in 0..needed {
        let refused = saved.write(&mut vec![0; length]).err();
        assert_eq!(refused, Some(SavedError::Full));
    }
    assert!(saved.write(&mut vec![0; needed]).is_ok());
    // Those that a firmware with more room wrote are none here.
    let mut memory = [0; BYTES];
    write_into(&mut memory, &saved, BYTES);
    let refused = Saved::<7>::read(&memory, &recipe);
    assert_eq!(refused, Err(SavedError::Damaged));
    saved.clear();
    assert_eq!(saved, Saved::new(&recipe));
}

/// A second reading of a sample takes the place of the first, also where there is no more room.
#[test]
fn a_second_reading_replaces_the_first() {
    let bytes = recipe_of(ModelKind::Neural);
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut saved = saved(&recipe, 0.2, 8);
    saved.insert(7, seen(0.9, 7)).unwrap();
    assert_eq!(saved.readings().len(), 8);
    for (place, (index, reading)) in saved.readings().iter().enumerate() {
        let material = if *index == 7 { 0.9 } else { 0.2 };
        assert_eq!((*index, *reading), (ORDER[place], seen(material, *index)));
    }
}

/// In version 0.1 a NaN was taken, kept and read back.
#[test]
fn what_is_no_reading_is_refused_when_it_is_saved_and_when_it_is_read() {
    /// As they are written, by anybody.
    #[derive(Serialize)]
    struct Forged {
        recipe: u32,
        readings: Vec<(u16, Reading)>,
    }
    let bytes = recipe_of(ModelKind::Neural);
    let recipe = Recipe::parse(&bytes).unwrap();
    let crc = |bytes: &[u8]| {
        bytes.iter().fold(!0_u32, |sum, byte| {
            (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
                (sum >> 1) ^ (0xedb8_8320 * (sum & 1))
            })
        }) ^ !0
    };
    let read = |reading: Reading| {
        let forged = Forged {
            recipe: recipe.checksum(),
            readings: vec![(4, seen(0.2, 4)), (2, reading)],
        };
        let mut buffer = [0; BYTES];
        let length = postcard::to_slice(&forged, &mut buffer).unwrap().len();
        let checksum = crc(&buffer[..length]).to_le_bytes();
        buffer[length..length + 4].copy_from_slice(&checksum);
        Saved::<8>::read(&buffer, &recipe)
    };
    assert_eq!(read(seen(0.2, 2)).unwrap().readings().len(), 2);
    for (value, error) in [
        (f32::NAN, ReadingError::NonFinite(1)),
        (f32::INFINITY, ReadingError::NonFinite(1)),
        (LEAST_READING.next_down(), ReadingError::Negative(1)),
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
    fn readings_are_read_as_they_were_written(
        values in prop::collection::vec(
            (any::<u16>(), prop::array::uniform3(-1.0..1e9_f32), any::<bool>()),
            0..=8,
        ),
    ) {
        let bytes = recipe_of(ModelKind::Neural);
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut saved = Saved::<8>::new(&recipe);
        for (index, brdf, saturated) in values {
            saved.insert(index, Reading { brdf, saturated }).unwrap();
        }
        let mut memory = [0x5A; BYTES];
        write_into(&mut memory, &saved, BYTES);
        prop_assert_eq!(Saved::read(&memory, &recipe), Ok(saved));
    }

    #[test]
    fn altered_readings_are_refused(
        taken in 0..=8_usize,
        index: prop::sample::Index,
        flip in 1..=255u8,
    ) {
        let bytes = recipe_of(ModelKind::Neural);
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut buffer = [0; BYTES];
        let length = saved(&recipe, 0.2, taken).write(&mut buffer).unwrap().len();
        buffer[index.index(length)] ^= flip;
        prop_assert!(Saved::<8>::read(&buffer, &recipe).is_err());
    }
}
