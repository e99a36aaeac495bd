//! The identity of a training run.

use std::fmt;

use glimpse_core::model::ModelKind;
use serde::{Deserialize, Serialize};

use super::plan::{Effort, Schedule, TrainedParts};

const CHECKSUM: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

/// The identity of a training run. Two runs with the same identity produce the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunIdentity {
    /// The model.
    pub model: ModelKind,
    /// The number of samples, n.
    pub samples: u32,
    /// The schedule.
    pub schedule: Schedule,
    /// The effort.
    pub effort: Effort,
    /// The parts that are trained.
    pub parts: TrainedParts,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The number of materials.
    pub materials: u32,
    /// The digest of all options that affect the result, as recorded in recipes.
    pub options_digest: u64,
    /// The digest of the materials' names and BRDFs.
    pub materials_digest: u64,
}

impl fmt::Display for RunIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} n = {}, {} {}, parts {}, seed {}, {} materials {:016x}, options {:016x}",
            self.model,
            self.samples,
            self.schedule.name(),
            self.effort.name(),
            self.parts.name(),
            self.seed,
            self.materials,
            self.materials_digest,
            self.options_digest,
        )
    }
}

/// Returns the CRC-64 of a value's postcard bytes.
pub(super) fn digest(value: &impl Serialize) -> u64 {
    // Serialization of numbers, strings, slices of known length and enums of them cannot fail.
    let bytes = postcard::to_stdvec(value).unwrap_or_default();
    CHECKSUM.checksum(&bytes)
}
