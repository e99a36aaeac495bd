//! A checkpoint: it is refused, or written again as it was.
//!
//! Random bytes never have the right checksum, so one input in two has it put right first.

use std::fs;

use crc::{CRC_32_ISO_HDLC, Crc};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Effort, Parts, Schedule};
use glimpse_training::meta::checkpoint::{Checkpoint, CheckpointError};
use glimpse_training::meta::identity::RunIdentity;

use crate::{Folder, refused};

/// Magic and checksum.
const HEADER: usize = 8;
const NAME: &str = "checkpoint.bin";
/// The run of the seeds `valid`.
pub const RUN: RunIdentity = RunIdentity {
    model: ModelKind::Phong,
    samples: 1,
    schedule: Schedule::Joint,
    effort: Effort::Quick,
    parts: Parts::All,
    seed: 7,
    materials: 3,
    options_digest: 0x0123_4567_89ab_cdef,
    materials_digest: u64::MAX,
};

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some((mend, bytes)) = input.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if mend & 1 == 1 && bytes.len() >= HEADER {
        let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[HEADER..]);
        bytes[4..HEADER].copy_from_slice(&checksum.to_le_bytes());
    }
    let folder = Folder::new();
    let path = folder.write(NAME, &bytes);
    let found = match Checkpoint::read(&path, &RUN) {
        Ok(found) => found.expect("it is there"),
        Err(error) => {
            let is_known = matches!(
                error,
                CheckpointError::Damaged { .. }
                    | CheckpointError::OtherRun { .. }
                    | CheckpointError::OtherVersion { .. }
            );
            assert!(is_known, "{error}");
            return refused(&error, NAME);
        }
    };
    assert_eq!(found.run, RUN);
    found.write(&path).expect("it is written");
    let written = fs::read(&path).expect("it is there");
    let again = Checkpoint::read(&path, &RUN).expect("what is written is read");
    again
        .expect("it is there")
        .write(&path)
        .expect("it is written");
    assert_eq!(fs::read(&path).expect("it is there"), written);
}
