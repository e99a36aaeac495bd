//! Checkpoints: a training run as it stands, written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::outer::Standing;
use crate::files::write_whole;

/// The file's name within the checkpoint directory.
const FILE: &str = "checkpoint.bin";

/// Why a checkpoint cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The operating system refuses to write.
    #[error(
        "cannot write the checkpoint {}: {source}; name a writable directory with --checkpoint",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is nothing to resume from.
    #[error("cannot read the checkpoint {}: {source}; start without --resume", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The bytes are not a checkpoint of this program's version.
    #[error("{} is damaged or of another version; start without --resume", .0.display())]
    Damaged(PathBuf),
    /// It is of another training run.
    #[error(
        "{} belongs to another run ({found}, not {expected}); repeat that run's options, or start \
         without --resume", path.display()
    )]
    OtherRun {
        /// The file.
        path: PathBuf,
        /// The run at hand.
        expected: String,
        /// The run of the checkpoint.
        found: String,
    },
    /// burn cannot record or restore the parameters.
    #[error("the meta-parameters cannot be recorded: {0}")]
    Record(String),
}

/// A training run as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// All options that decide the outcome, in words.
    pub run: String,
    /// How far it is.
    pub standing: Standing,
    /// burn's record of meta-parameters and optimizer.
    pub record: Vec<u8>,
}

impl Checkpoint {
    /// Makes sure that `directory` exists and can be written to.
    ///
    /// # Errors
    /// If not.
    pub fn prepare(directory: &Path) -> Result<(), CheckpointError> {
        let fail = |source| CheckpointError::Write {
            path: directory.join(FILE),
            source,
        };
        fs::create_dir_all(directory).map_err(fail)?;
        tempfile::NamedTempFile::new_in(directory).map_err(fail)?;
        Ok(())
    }

    /// Writes it into `directory`, replacing an older one in one step.
    ///
    /// # Errors
    /// If it cannot be written; the older one is then still whole.
    pub fn write(&self, directory: &Path) -> Result<(), CheckpointError> {
        let path = directory.join(FILE);
        let bytes = postcard::to_stdvec(self)
            .map_err(|error| CheckpointError::Record(error.to_string()))?;
        write_whole(&path, &bytes).map_err(|source| CheckpointError::Write { path, source })
    }

    /// Reads the one in `directory`, which must be of the run at hand.
    ///
    /// # Errors
    /// If there is none, or it is damaged, or of another run.
    pub fn read(directory: &Path, run: &str) -> Result<Self, CheckpointError> {
        let path = directory.join(FILE);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(CheckpointError::Read { path, source }),
        };
        match postcard::from_bytes::<Self>(&bytes) {
            Ok(checkpoint) if checkpoint.run == run => Ok(checkpoint),
            Ok(checkpoint) => Err(CheckpointError::OtherRun {
                path,
                expected: run.into(),
                found: checkpoint.run,
            }),
            Err(_) => Err(CheckpointError::Damaged(path)),
        }
    }

    /// Removes the one in `directory`, and the directory if nothing else is in it.
    pub fn remove(directory: &Path) {
        // Nothing is lost if either stays.
        let _ = fs::remove_file(directory.join(FILE));
        let _ = fs::remove_dir(directory);
    }
}
