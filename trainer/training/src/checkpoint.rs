//! Checkpoint files: the state of a training run, each written atomically.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::checksum::crc_32;
use glimpse_fitting::recipe::identity::RunIdentity;
use glimpse_materials::files;
use glimpse_materials::untrusted::read_at_most;
use glimpse_optimizer::{MetaValues, Optimizer};
use serde::{Deserialize, Serialize};

use super::scan_budget::INITIAL_WEIGHT;

/// A file starts with the magic bytes, one format byte, and the CRC-32 of the rest, little-endian.
const MAGIC: [u8; 3] = *b"GLC";
const FORMAT: u8 = b'7';
/// The maximum size of a file in bytes, hundreds of times the size for the largest network.
const MAX_BYTES: u64 = 1 << 30;

/// A checkpoint cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// An I/O error on writing.
    #[error(
        "cannot write the checkpoint {}: {source}; free disk space, or write the recipe to another directory",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The I/O error.
        source: io::Error,
    },
    /// An I/O error on reading.
    #[error("cannot read the checkpoint {}: {source}; delete it to start over", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The I/O error.
        source: io::Error,
    },
    /// The file is not a complete checkpoint, or that of another version of this program.
    #[error("{} is not a usable checkpoint: {reason}; delete it to start over", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The defect.
        reason: &'static str,
    },
    /// The checkpoint belongs to another training run.
    #[error(
        "{} belongs to a run with other {1}; repeat that run with its {1}, or delete it to start over",
        path.display(), expected.difference(actual)
    )]
    OtherRun {
        /// The file.
        path: PathBuf,
        /// The identity of the current run.
        expected: RunIdentity,
        /// The identity stored in the checkpoint.
        actual: RunIdentity,
    },
}

/// The state of a training run, as saved to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingState {
    /// The identity of the run.
    pub identity: RunIdentity,
    /// Meta-parameters and optimizer.
    pub optimizer: Optimizer,
    /// The number of completed outer steps of all phases.
    pub done: usize,
    /// The outer loss, smoothed over about 50 steps; None before the first finite one.
    pub smoothed_loss: Option<f32>,
    /// The sum of losses over the steps of the current epoch, including the barriers.
    pub epoch_loss: f32,
    /// The weight of a second of motion, for a run with a [scan budget](super::scan_budget).
    pub motion_weight: f32,
    /// The best values so far with their loss, as defined by the phase's [`Criterion`](super::outer::Criterion).
    pub best: Option<(f32, MetaValues)>,
}

impl TrainingState {
    /// Creates the state before the first step.
    #[must_use]
    pub fn new(identity: RunIdentity, values: MetaValues) -> Self {
        Self {
            identity,
            optimizer: Optimizer::new(values),
            done: 0,
            smoothed_loss: None,
            epoch_loss: 0.0,
            motion_weight: INITIAL_WEIGHT,
            best: None,
        }
    }

    /// Returns the best values so far, or the present ones.
    #[must_use]
    pub fn best_values(&self) -> MetaValues {
        match &self.best {
            Some((_, values)) => values.clone(),
            None => self.optimizer.values.clone(),
        }
    }

    /// Stores the present values if their loss is below the smallest so far. A loss of NaN is never stored.
    pub fn store_if_better(&mut self, loss: f32) {
        let smallest = self.best.as_ref().map_or(f32::INFINITY, |(loss, _)| *loss);
        if loss < smallest {
            self.best = Some((loss, self.optimizer.values.clone()));
        }
    }

    /// Returns the path of a run's checkpoint in `directory`. The first run is 0.
    #[must_use]
    pub fn path(directory: &Path, run: usize) -> PathBuf {
        match run {
            0 => directory.join("checkpoint.bin"),
            run => directory.join(format!("checkpoint-{run}.bin")),
        }
    }

    /// Returns true if `directory` holds a checkpoint.
    #[must_use]
    pub fn exists_in(directory: &Path) -> bool {
        Self::path(directory, 0).exists()
    }

    /// Parses a file, or returns its defect. The checksum covers all bytes after it.
    fn parse(bytes: &[u8]) -> Result<Self, &'static str> {
        let rest = bytes.strip_prefix(&MAGIC);
        let rest = rest.ok_or("its first bytes are not those of a checkpoint")?;
        let parts = rest.split_first_chunk::<5>().ok_or("it is truncated")?;
        let ([format, checksum @ ..], body) = parts;
        if *format != FORMAT {
            return Err("another version of this program wrote it, and can resume it");
        }
        if crc_32(body) != u32::from_le_bytes(*checksum) {
            return Err("its checksum does not match");
        }
        match postcard::take_from_bytes(body) {
            Ok((Self { optimizer, .. }, [])) if !optimizer.is_valid() => {
                Err("its optimizer has different numbers of values and moments")
            }
            Ok((checkpoint, [])) => Ok(checkpoint),
            _ => Err("its content does not follow the format"),
        }
    }

    /// Writes the checkpoint to a file, atomically replacing an older one.
    ///
    /// # Errors
    /// If the file cannot be written. An older file then remains intact.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let body = postcard::to_stdvec(self).expect("lists of known length have an encoding");
        let checksum = crc_32(&body).to_le_bytes();
        let bytes = [&MAGIC[..], &[FORMAT], &checksum, &body].concat();
        let directory = path.parent().map_or(Ok(()), files::ensure_dir);
        directory
            .and_then(|()| files::write_atomic(path, &bytes))
            .map_err(|source| CheckpointError::Write {
                path: path.into(),
                source,
            })
    }

    /// Reads a checkpoint of the run `identity`. Returns None if the file does not exist.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or belongs to another run or program version.
    pub fn read(path: &Path, identity: &RunIdentity) -> Result<Option<Self>, CheckpointError> {
        let path = path.to_owned();
        let bytes = match read_at_most(&path, MAX_BYTES) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CheckpointError::Read { path, source }),
        };
        match Self::parse(&bytes) {
            Ok(checkpoint) if checkpoint.identity == *identity => Ok(Some(checkpoint)),
            Ok(checkpoint) => Err(CheckpointError::OtherRun {
                path,
                expected: *identity,
                actual: checkpoint.identity,
            }),
            Err(reason) => Err(CheckpointError::Damaged { path, reason }),
        }
    }

    /// Removes all checkpoints in `directory`, also those that a killed process was writing, and the directory if it is
    /// then empty.
    pub fn remove(directory: &Path) {
        // Failures are harmless: a remaining file is not used.
        for run in 0.. {
            if fs::remove_file(Self::path(directory, run)).is_err() {
                break;
            }
        }
        for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
            if files::is_unfinished(&entry.path()) {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(directory);
    }
}

#[cfg(test)]
mod tests {
    use glimpse_optimizer::Groups;

    use super::*;

    const RUN: RunIdentity = RunIdentity {
        options: 0x0123_4567_89ab_cdef,
        materials: u64::MAX,
    };

    fn checkpoint() -> TrainingState {
        let values = Groups {
            initial: vec![0.5; 7],
            hyperparameters: vec![-1.0; 7],
            pattern: vec![2.0; 3],
            ..Groups::default()
        };
        let mut checkpoint = TrainingState::new(RUN, values.clone());
        let rates = values.map(|_| 1e-3);
        checkpoint.optimizer.step(values, &rates);
        checkpoint
    }

    #[test]
    fn rejects_damaged_checkpoints_and_those_of_another_run() {
        let original = checkpoint();
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let path = TrainingState::path(scratch.path(), 0);
        original.write(&path).expect("the file is written");
        let read = TrainingState::read(&path, &RUN).expect("the file is intact");
        assert_eq!(read, Some(original));
        for other in [
            RunIdentity { options: 1, ..RUN },
            RunIdentity {
                materials: 1,
                ..RUN
            },
        ] {
            let error = TrainingState::read(&path, &other).expect_err("the run differs");
            let CheckpointError::OtherRun {
                expected, actual, ..
            } = error
            else {
                panic!("{error}")
            };
            assert_eq!((expected, actual), (other, RUN));
        }

        let bytes = fs::read(&path).expect("the file exists");
        let assert_damaged = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("the file is written");
            let error = TrainingState::read(&path, &RUN).expect_err("the file is damaged");
            assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
        };
        for position in 0..bytes.len() {
            assert_damaged(&bytes[..position]);
            let mut other = bytes.clone();
            other[position] ^= 0x40;
            assert_damaged(&other);
        }
        assert_damaged(&[&bytes[..], &[0]].concat());
    }
}
