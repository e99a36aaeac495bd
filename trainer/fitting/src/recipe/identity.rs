//! The identity of a training run.

use serde::{Deserialize, Serialize};

const CHECKSUM: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

/// The identity of a training run. Two runs with the same identity produce the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunIdentity {
    /// The digest of all options that affect the result.
    pub options: u64,
    /// The digest of the materials' names and BRDFs.
    pub materials: u64,
}

impl RunIdentity {
    /// Returns the plural noun for what differs from another run.
    pub fn difference(&self, other: &Self) -> &'static str {
        if self.options == other.options {
            "materials"
        } else if self.materials == other.materials {
            "options"
        } else {
            "options and materials"
        }
    }
}

/// Returns the CRC-64 of a value's postcard encoding.
pub(super) fn digest<T: Serialize + ?Sized>(value: &T) -> u64 {
    let bytes = postcard::to_stdvec(value).expect("lists of known length have an encoding");
    CHECKSUM.checksum(&bytes)
}
