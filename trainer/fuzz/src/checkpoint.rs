//! Check of checkpoints: the reader rejects a checkpoint, or reproduces its bytes.
//!
//! An input contains a byte and a checkpoint. If the byte is odd, the checksum of the checkpoint is corrected before it
//! is read, because random bytes almost never have the right checksum.

use std::fs;

use glimpse_core::checksum::crc_32;
use glimpse_fitting::recipe::identity::RunIdentity;
use glimpse_training::checkpoint::TrainingState;

use crate::support::{Folder, accepted};

/// Length of magic and checksum in bytes.
const HEADER_LENGTH: usize = 8;
const NAME: &str = "checkpoint.bin";
/// The run of the seed `valid`.
pub const RUN: RunIdentity = RunIdentity {
    options: 0x0123_4567_89ab_cdef,
    materials: u64::MAX,
};

/// Checks one input.
pub(crate) fn check(input: &[u8]) {
    let Some((correct_checksum, bytes)) = input.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if correct_checksum & 1 == 1 && bytes.len() >= HEADER_LENGTH {
        let checksum = crc_32(&bytes[HEADER_LENGTH..]);
        bytes[4..HEADER_LENGTH].copy_from_slice(&checksum.to_le_bytes());
    }
    let folder = Folder::new();
    let path = folder.write(NAME, &bytes);
    let read =
        || accepted(TrainingState::read(&path, &RUN), NAME).map(|read| read.expect("a file"));
    let Some(checkpoint) = read() else {
        return;
    };
    assert_eq!(checkpoint.identity, RUN);
    let rewrite = |checkpoint: TrainingState| {
        checkpoint.write(&path).expect("the file is written");
        fs::read(&path).expect("the file exists")
    };
    let written = rewrite(checkpoint);
    let reread = read().expect("a written checkpoint is valid");
    assert_eq!(rewrite(reread), written);
}
