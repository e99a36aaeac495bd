//! Checkpoints: a training run as it stands, written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use glimpse_optimizer::Record;

use super::state::RunState;
use crate::files;
use crate::foreign::{read_at_most, shown_up_to};

/// The name of the first stage's file within the checkpoint directory, and the ending of all files.
const FIRST: &str = "checkpoint";
const ENDING: &str = "bin";
/// How a file begins: with these bytes, of which the last counts formats, and the CRC-32 of all that
/// follows, little-endian.
const MAGIC: [u8; 4] = *b"GLC2";
const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// The longest file that is read: hundreds of times the largest network's.
const MOST_BYTES: u64 = 1 << 30;

/// Why a checkpoint cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The operating system refuses to write.
    #[error(
        "cannot write the checkpoint {}: {source}; make room, or name a writable directory with \
         --checkpoint",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The operating system refuses to read.
    #[error("cannot read the checkpoint {}: {source}; remove it to start anew", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The bytes are not a checkpoint of this program's version.
    #[error("{} is damaged or of another version: {what}; remove it to start anew", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// In what way.
        what: &'static str,
    },
    /// It is of another training run.
    #[error(
        "{} belongs to another run ({}, not {expected}); repeat that run's options, or \
         remove it to start anew", path.display(), shown_up_to(400, found)
    )]
    OtherRun {
        /// The file.
        path: PathBuf,
        /// The run at hand.
        expected: String,
        /// The run of the checkpoint.
        found: String,
    },
    /// The run cannot be written down.
    #[error("the run cannot be recorded: {0}")]
    Record(String),
}

/// A training run as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// All options that decide the outcome, in words.
    pub run: String,
    /// How far it is.
    pub state: RunState,
    /// Meta-parameters and optimizer.
    pub record: Record,
}

impl Checkpoint {
    /// The one of a stage in `directory`; the first stage is 0.
    #[must_use]
    pub fn path(directory: &Path, stage: usize) -> PathBuf {
        match stage {
            0 => directory.join(format!("{FIRST}.{ENDING}")),
            stage => directory.join(format!("{FIRST}-{stage}.{ENDING}")),
        }
    }

    /// Makes sure that this run can be saved in a file to its end.
    ///
    /// # Errors
    /// If not.
    pub fn try_write(&self, path: &Path) -> Result<(), CheckpointError> {
        // The optimizer and the best values will come to it, and the file that it replaces.
        let bytes = 8 * self.bytes()?.len();
        make_folder_of(path)
            .and_then(|()| files::try_write(path, bytes))
            .map_err(|source| CheckpointError::Write {
                path: path.into(),
                source,
            })
    }

    /// True if there is one in `directory`.
    #[must_use]
    pub fn is_in(directory: &Path) -> bool {
        Self::path(directory, 0).exists()
    }

    fn bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        let body = postcard::to_stdvec(self)
            .map_err(|error| CheckpointError::Record(error.to_string()))?;
        let checksum = CHECKSUM.checksum(&body).to_le_bytes();
        Ok([&MAGIC[..], &checksum, &body].concat())
    }

    /// The one of a file's bytes, none of which may be another or missing; or what is wrong with them.
    fn parse(bytes: &[u8]) -> Result<Self, &'static str> {
        let Some((checksum, body)) = bytes
            .strip_prefix(&MAGIC)
            .and_then(|rest| rest.split_first_chunk())
        else {
            return Err("it does not begin as this version's do");
        };
        if CHECKSUM.checksum(body) != u32::from_le_bytes(*checksum) {
            return Err("its checksum is another");
        }
        match postcard::take_from_bytes(body) {
            Ok((checkpoint, [])) => Ok(checkpoint),
            Ok(_) => Err("something was appended"),
            Err(_) => Err("it is not what this version writes"),
        }
    }

    /// Writes it into a file, replacing an older one in one step.
    ///
    /// # Errors
    /// If it cannot be written; the older one is then still whole.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let bytes = self.bytes()?;
        make_folder_of(path)
            .and_then(|()| files::write_whole(path, &bytes))
            .map_err(|source| CheckpointError::Write {
                path: path.into(),
                source,
            })
    }

    /// Reads the one in a file, which must be of the run at hand; None if there is none.
    ///
    /// # Errors
    /// If it is damaged, or of another run.
    pub fn read(path: &Path, run: &str) -> Result<Option<Self>, CheckpointError> {
        let path = path.to_owned();
        let bytes = match read_at_most(&path, MOST_BYTES) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CheckpointError::Read { path, source }),
        };
        match Self::parse(&bytes) {
            Ok(checkpoint) if checkpoint.run == run => Ok(Some(checkpoint)),
            Ok(checkpoint) => Err(CheckpointError::OtherRun {
                path,
                expected: run.into(),
                found: checkpoint.run,
            }),
            Err(what) => Err(CheckpointError::Damaged { path, what }),
        }
    }

    /// Removes those in `directory`, and the directory if nothing else is in it.
    pub fn remove(directory: &Path) {
        // Nothing is lost if any of it stays.
        for stage in 0.. {
            if fs::remove_file(Self::path(directory, stage)).is_err() {
                break;
            }
        }
        let _ = fs::remove_dir(directory);
    }
}

fn make_folder_of(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), files::make_folder)
}

#[cfg(test)]
mod tests {
    use glimpse_optimizer::{Groups, Optimization};

    use super::*;

    #[test]
    fn a_checkpoint_is_whole_or_damaged_and_not_another_one() {
        let values = Groups {
            initial: vec![0.5; 7],
            hyperparameters: vec![-1.0; 7],
            pattern: vec![2.0; 3],
            ..Groups::default()
        };
        let mut optimization = Optimization::new(values.clone());
        let rates = Groups {
            initial: 1e-3,
            hyperparameters: 1e-3,
            pattern: 1e-3,
            ..Groups::default()
        };
        optimization.step(values, &rates);
        let whole = Checkpoint {
            run: "a run".into(),
            state: RunState::default(),
            record: optimization.record(),
        };
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let path = Checkpoint::path(scratch.path(), 0);
        whole.write(&path).expect("it is written");
        let found = Checkpoint::read(&path, "a run").expect("it is whole");
        assert_eq!(found, Some(whole));
        let bytes = fs::read(&path).expect("it is there");
        for length in 0..bytes.len() {
            fs::write(&path, &bytes[..length]).expect("it is written");
            let error = Checkpoint::read(&path, "a run").expect_err("a part of it");
            assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
        }
        for place in 0..bytes.len() {
            let mut other = bytes.clone();
            other[place] ^= 0x40;
            fs::write(&path, other).expect("it is written");
            let error = Checkpoint::read(&path, "a run").expect_err("another byte");
            assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
        }
        fs::write(&path, [&bytes[..], &[0]].concat()).expect("it is written");
        let error = Checkpoint::read(&path, "a run").expect_err("a byte more");
        assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
    }
}
