//! A scan that loses power anywhere goes on where it was or begins afresh, and ends in the same bits.

mod common;

use common::{linear, neural, write, write_linear};
use glimpse_core::fit::Workspace;
use glimpse_core::model::{Neural, ParameterSet};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LinearScan, Measurement, Record, RecordError, Scan};
use proptest::prelude::*;

const BYTES: usize = Record::<8>::BYTES;

/// What the sensor sees at a sample of the pattern.
fn measured(material: f32, index: usize) -> Measurement {
    Measurement {
        brdf: [material + 0.1 * index as f32, 0.3, 0.05 * index as f32],
        saturated: index == 3,
    }
}

/// A record of a scan of this material that has come so far.
fn record(recipe: &Recipe<'_>, material: f32, taken: usize) -> Record<8> {
    let mut record = Record::new(recipe);
    for index in 0..taken {
        record.push(measured(material, index)).unwrap();
    }
    record
}

/// Memory that holds what `record` writes, after whatever was there.
fn write_into(memory: &mut [u8; BYTES], record: &Record<8>, cut: usize) {
    let mut buffer = [0; BYTES];
    let bytes = record.write(&mut buffer).unwrap();
    let cut = cut.min(bytes.len());
    memory[..cut].copy_from_slice(&bytes[..cut]);
}

/// Bits of the parameters and of the residual of a scan that begins with what is kept and measures
/// the rest; and how many it had to measure.
fn go_on(recipe: Recipe<'_>, kept: &[Measurement]) -> (Vec<u32>, usize) {
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 8>::new(recipe, &mut workspace).unwrap();
    for measurement in kept {
        scan.record(*measurement).unwrap();
    }
    let mut taken = 0;
    while let Some((index, _)) = scan.next_directions() {
        scan.record(measured(0.2, usize::from(index))).unwrap();
        taken += 1;
    }
    while !scan.advance_fit(7).is_complete() {}
    let residual = scan.residual();
    let numbers = [residual.mean, residual.worst, f32::from(residual.saturated)];
    let parameters = scan.parameters().iter().copied();
    let bits = parameters.chain(numbers).map(f32::to_bits).collect();
    (bits, taken)
}

/// Power is lost after each byte of each write in turn: of the scan's own, and of the one that
/// forgets the scan before it, of another material.
#[test]
fn power_lost_at_any_byte_of_any_write_ends_in_the_same_bits() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let (whole, all) = go_on(recipe, &[]);
    assert_eq!(all, 8);

    // Which results are right, by how many measurements outlast.
    let resumed: Vec<_> = (0..=8)
        .map(|kept| go_on(recipe, record(&recipe, 0.2, kept).measurements()))
        .collect();
    for (kept, (bits, taken)) in resumed.iter().enumerate() {
        assert_eq!(*bits, whole);
        assert_eq!(*taken, 8 - kept);
    }

    let mut cuts = 0;
    let mut damaged = 0;
    let mut before = [0xA5; BYTES];
    write_into(&mut before, &record(&recipe, 0.7, 8), BYTES);
    for taken in 0..=8 {
        let after = record(&recipe, 0.2, taken);
        for cut in 0..=BYTES {
            let mut memory = before;
            write_into(&mut memory, &after, cut);
            cuts += 1;
            match Record::<8>::read(&memory, &recipe) {
                Ok(found) if found == after => {}
                // Not a byte was altered yet.
                Ok(found) => {
                    assert_eq!(memory, before);
                    let old = match taken {
                        0 => record(&recipe, 0.7, 8),
                        taken => record(&recipe, 0.2, taken - 1),
                    };
                    assert_eq!(found, old);
                }
                Err(error) => {
                    assert_eq!(error, RecordError::Damaged);
                    damaged += 1;
                }
            }
        }
        write_into(&mut before, &after, BYTES);
    }
    assert_eq!(cuts, 9 * (BYTES + 1));
    assert!(damaged > 300, "{damaged}");
}

/// A fit cut short begins again from the measurements, and a linear scan goes on as well.
#[test]
fn power_lost_in_the_middle_of_a_fit_ends_in_the_same_bits() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let (whole, _) = go_on(recipe, &[]);
    let kept = record(&recipe, 0.2, 8);
    for done in [1, 7, 8, 100, 159] {
        let mut workspace = Workspace::<Neural>::new();
        let mut scan = Scan::<Neural, 8>::new(recipe, &mut workspace).unwrap();
        for measurement in kept.measurements() {
            scan.record(*measurement).unwrap();
        }
        assert_eq!(scan.advance_fit(done).done as usize, done);
        drop(scan); // all that it had learned is lost
        let mut memory = [0; BYTES];
        write_into(&mut memory, &kept, BYTES);
        let found = Record::<8>::read(&memory, &recipe).unwrap();
        assert_eq!(go_on(recipe, found.measurements()), (whole.clone(), 0));
    }

    let bytes = write_linear(&linear()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut results = Vec::new();
    for taken in 0..=8 {
        let mut memory = [0.0; LinearScan::<8>::memory_length(8, 5)];
        let mut scan = LinearScan::<8>::new(recipe, &mut memory).unwrap();
        for measurement in record(&recipe, 0.2, taken).measurements() {
            scan.record(*measurement).unwrap();
        }
        assert_eq!(scan.next_directions().is_none(), taken == 8);
        while let Some((index, _)) = scan.next_directions() {
            scan.record(measured(0.2, usize::from(index))).unwrap();
        }
        while !scan.advance_fit(1).is_complete() {}
        results.push((scan.coefficients().to_vec(), scan.residual()));
    }
    assert!(results.iter().all(|result| *result == results[0]));
}

#[test]
fn a_record_of_another_recipe_is_refused_by_name() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut other = neural();
    other.expected_loss *= 2.0;
    let other = write(&other).unwrap();
    let other = Recipe::parse(&other).unwrap();
    let mut memory = [0; BYTES];
    write_into(&mut memory, &record(&recipe, 0.2, 5), BYTES);
    let found = recipe.checksum();
    let refused = Record::<8>::read(&memory, &other);
    assert_eq!(refused, Err(RecordError::Recipe { found }));
}

#[test]
fn memory_that_nobody_wrote_holds_no_record() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    for memory in [[0; BYTES], [0xFF; BYTES], [0xA5; BYTES]] {
        assert_eq!(
            Record::<8>::read(&memory, &recipe),
            Err(RecordError::Damaged)
        );
    }
    for length in 0..6 {
        assert!(Record::<8>::read(&[0; 6][..length], &recipe).is_err());
    }
}

#[test]
fn a_record_has_room_for_its_capacity_and_no_more() {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut record = record(&recipe, 0.2, 8);
    let refused = record.push(measured(0.2, 8));
    assert_eq!(refused, Err(RecordError::Full));
    let needed = record.write(&mut [0; BYTES]).unwrap().len();
    for length in 0..needed {
        let refused = record.write(&mut vec![0; length]).err();
        assert_eq!(refused, Some(RecordError::Full));
    }
    assert!(record.write(&mut vec![0; needed]).is_ok());
    // One written by a firmware with more room is none here.
    let mut memory = [0; BYTES];
    write_into(&mut memory, &record, BYTES);
    assert_eq!(
        Record::<7>::read(&memory, &recipe),
        Err(RecordError::Damaged)
    );
    record.clear();
    assert_eq!(record, Record::new(&recipe));
}

proptest! {
    #[test]
    fn a_record_is_read_as_it_was_written(
        values in prop::collection::vec((prop::array::uniform3(0.0..1e9_f32), any::<bool>()), 0..=8),
    ) {
        let bytes = write(&neural()).unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut record = Record::<8>::new(&recipe);
        for (brdf, saturated) in values {
            record.push(Measurement { brdf, saturated }).unwrap();
        }
        let mut memory = [0x5A; BYTES];
        write_into(&mut memory, &record, BYTES);
        prop_assert_eq!(Record::read(&memory, &recipe), Ok(record));
    }

    #[test]
    fn an_altered_record_is_refused(
        taken in 0..=8_usize,
        index: prop::sample::Index,
        flip in 1..=255u8,
    ) {
        let bytes = write(&neural()).unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut buffer = [0; BYTES];
        let length = record(&recipe, 0.2, taken).write(&mut buffer).unwrap().len();
        buffer[index.index(length)] ^= flip;
        prop_assert!(Record::<8>::read(&buffer, &recipe).is_err());
    }
}
