//! Checkpoints: a training run as it stands, written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glimpse_materials::files;
use glimpse_materials::untrusted::read_at_most;
use glimpse_optimizer::Record;
use serde::{Deserialize, Serialize};

use super::identity::RunIdentity;
use super::state::RunState;

/// The name of the first stage's file within the checkpoint directory, and the ending of all files.
const FIRST: &str = "checkpoint";
const ENDING: &str = "bin";
/// A file begins with these bytes, a byte that counts formats, and the CRC-32 of all that follows,
/// little-endian.
const MAGIC: [u8; 3] = *b"GLC";
const FORMAT: u8 = b'3';
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
    #[error("cannot read the checkpoint {}: {source}; remove it to start again", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Another version of this program wrote it.
    #[error(
        "{} is a checkpoint of another version of this program; resume with that version, or remove it to \
         start again", path.display()
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
    },
    /// The bytes are not a checkpoint.
    #[error("{} is not a whole checkpoint: {what}; remove it to start again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// In what way.
        what: &'static str,
    },
    /// It is of another training run.
    #[error(
        "{} belongs to another run ({found}, not {expected}); repeat that run's options, or remove it to \
         start again", path.display()
    )]
    OtherRun {
        /// The file.
        path: PathBuf,
        /// The run at hand.
        expected: Box<RunIdentity>,
        /// The run of the checkpoint.
        found: Box<RunIdentity>,
    },
    /// The run cannot be written down.
    #[error("the run cannot be recorded: {0}")]
    Record(String),
}

/// A training run as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// The identity of the run.
    pub run: RunIdentity,
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
        Ok([&MAGIC[..], &[FORMAT], &checksum, &body].concat())
    }

    /// Reads a file's bytes, all of which are covered by the checksum.
    fn parse(bytes: &[u8]) -> Result<Self, Refusal> {
        let Some((format, rest)) = bytes.strip_prefix(&MAGIC).and_then(<[u8]>::split_first) else {
            return Err(Refusal::Damaged("it does not begin as checkpoints do"));
        };
        if *format != FORMAT {
            return Err(Refusal::OtherVersion);
        }
        let Some((checksum, body)) = rest.split_first_chunk() else {
            return Err(Refusal::Damaged("it is cut off"));
        };
        if CHECKSUM.checksum(body) != u32::from_le_bytes(*checksum) {
            return Err(Refusal::Damaged("its checksum is wrong"));
        }
        match postcard::take_from_bytes(body) {
            Ok((checkpoint, [])) => Ok(checkpoint),
            Ok(_) => Err(Refusal::Damaged("bytes follow its end")),
            Err(_) => Err(Refusal::Damaged("its content does not follow the format")),
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
    pub fn read(path: &Path, run: &RunIdentity) -> Result<Option<Self>, CheckpointError> {
        let path = path.to_owned();
        let bytes = match read_at_most(&path, MOST_BYTES) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CheckpointError::Read { path, source }),
        };
        match Self::parse(&bytes) {
            Ok(checkpoint) if checkpoint.run == *run => Ok(Some(checkpoint)),
            Ok(checkpoint) => Err(CheckpointError::OtherRun {
                path,
                expected: Box::new(*run),
                found: Box::new(checkpoint.run),
            }),
            Err(Refusal::OtherVersion) => Err(CheckpointError::OtherVersion { path }),
            Err(Refusal::Damaged(what)) => Err(CheckpointError::Damaged { path, what }),
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

/// The reason why bytes are refused.
enum Refusal {
    OtherVersion,
    Damaged(&'static str),
}

fn make_folder_of(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), files::make_folder)
}

#[cfg(test)]
mod tests {
    use glimpse_core::model::ModelKind;
    use glimpse_core::recipe::{Effort, Parts, Schedule};
    use glimpse_optimizer::{Groups, Optimization};

    use super::*;

    const RUN: RunIdentity = RunIdentity {
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

    fn checkpoint() -> Checkpoint {
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
        Checkpoint {
            run: RUN,
            state: RunState::default(),
            record: optimization.record(),
        }
    }

    #[test]
    fn a_checkpoint_is_whole_or_damaged_and_not_another_one() {
        let whole = checkpoint();
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let path = Checkpoint::path(scratch.path(), 0);
        whole.write(&path).expect("it is written");
        let found = Checkpoint::read(&path, &RUN).expect("it is whole");
        assert_eq!(found, Some(whole));
        let bytes = fs::read(&path).expect("it is there");
        for length in 0..bytes.len() {
            fs::write(&path, &bytes[..length]).expect("it is written");
            let error = Checkpoint::read(&path, &RUN).expect_err("a part of it");
            assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
        }
        for place in 0..bytes.len() {
            let mut other = bytes.clone();
            other[place] ^= 0x40;
            fs::write(&path, other).expect("it is written");
            let error = Checkpoint::read(&path, &RUN).expect_err("another byte");
            let is_version = matches!(error, CheckpointError::OtherVersion { .. });
            assert_eq!(is_version, place == MAGIC.len(), "{error}");
            let is_damaged = matches!(error, CheckpointError::Damaged { .. });
            assert_eq!(is_damaged, !is_version, "{error}");
        }
        fs::write(&path, [&bytes[..], &[0]].concat()).expect("it is written");
        let error = Checkpoint::read(&path, &RUN).expect_err("a byte more");
        assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
    }

    #[test]
    fn a_checkpoint_of_another_run_or_version_is_refused() {
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let path = Checkpoint::path(scratch.path(), 0);
        checkpoint().write(&path).expect("it is written");
        for other in [
            RunIdentity {
                options_digest: 1,
                ..RUN
            },
            RunIdentity {
                materials_digest: 1,
                ..RUN
            },
            RunIdentity { seed: 8, ..RUN },
        ] {
            match Checkpoint::read(&path, &other).expect_err("another run") {
                CheckpointError::OtherRun {
                    expected, found, ..
                } => {
                    assert_eq!((*expected, *found), (other, RUN));
                }
                error => panic!("{error}"),
            }
        }
        // As the version before wrote it: its run was a text.
        let old = [&b"GLC2"[..], &[0; 40]].concat();
        fs::write(&path, old).expect("it is written");
        let error = Checkpoint::read(&path, &RUN).expect_err("another version");
        assert!(
            matches!(error, CheckpointError::OtherVersion { .. }),
            "{error}"
        );
    }
}
