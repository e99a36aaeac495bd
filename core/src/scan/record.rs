//! What was measured, as bytes that can be kept where a reset leaves them.
//!
//! # Format
//!
//! ```text
//! postcard( recipe: u32, measurements: list of (brdf: 3 x f32, saturated: bool) )  CRC-32
//! ```
//!
//! The recipe is named by its checksum. The CRC is ISO-HDLC over the postcard bytes,
//! little-endian; what follows it in memory does not matter.
//!
//! The whole record is written anew after each measurement. If that is cut short, or the memory has
//! lost what it held, the CRC says so, and the scan begins afresh.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::Measurement;
use crate::recipe::Recipe;

/// Bytes of a measurement: three numbers and a flag.
const MEASUREMENT_BYTES: usize = 3 * 4 + 1;
/// Bytes of the recipe's checksum and of the number of measurements, at most, and of the CRC.
const OTHER_BYTES: usize = 5 + 5 + 4;

const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why bytes are not a record of this recipe's measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecordError {
    /// No whole record is there: nothing was written, or it was cut short or altered.
    Damaged,
    /// It is of measurements by another recipe.
    Recipe {
        /// That recipe's checksum.
        found: u32,
    },
    /// There is no room for so many measurements.
    Full,
}

impl core::fmt::Display for RecordError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => f.write_str("there is no whole record of measurements"),
            Self::Recipe { found } => {
                write!(f, "the record is of measurements by the recipe {found:08x}")
            }
            Self::Full => f.write_str("the record has no room for so many measurements"),
        }
    }
}

impl core::error::Error for RecordError {}

/// The measurements of a scan under way, in the order of the recipe's pattern; `CAPACITY` is the
/// largest n that it has room for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record<const CAPACITY: usize> {
    recipe: u32,
    measurements: Vec<Measurement, CAPACITY>,
}

impl<const CAPACITY: usize> Record<CAPACITY> {
    /// The most bytes that a record has.
    pub const BYTES: usize = MEASUREMENT_BYTES
        .saturating_mul(CAPACITY)
        .saturating_add(OTHER_BYTES);

    /// Nothing is measured yet.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>) -> Self {
        Self {
            recipe: recipe.checksum(),
            measurements: Vec::new(),
        }
    }

    /// Reads what [`Record::write`] wrote.
    ///
    /// # Errors
    /// If no whole record is there, or one of another recipe.
    pub fn read(bytes: &[u8], recipe: &Recipe<'_>) -> Result<Self, RecordError> {
        let (record, rest) =
            postcard::take_from_bytes::<Self>(bytes).map_err(|_| RecordError::Damaged)?;
        let content = bytes.get(..bytes.len().saturating_sub(rest.len()));
        let checksum = CHECKSUM.checksum(content.unwrap_or_default());
        match rest.first_chunk() {
            Some(written) if u32::from_le_bytes(*written) == checksum => {}
            _ => return Err(RecordError::Damaged),
        }
        if record.recipe == recipe.checksum() {
            Ok(record)
        } else {
            Err(RecordError::Recipe {
                found: record.recipe,
            })
        }
    }

    /// Writes the record into `buffer` and returns the bytes used.
    ///
    /// # Errors
    /// [`RecordError::Full`] if `buffer` has no room for it; [`Record::BYTES`] always suffice.
    pub fn write<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], RecordError> {
        let content = postcard::to_slice(self, buffer).map_err(|_| RecordError::Full)?;
        let (length, checksum) = (content.len(), CHECKSUM.checksum(content).to_le_bytes());
        let place = buffer.get_mut(length..).unwrap_or_default();
        *place.first_chunk_mut().ok_or(RecordError::Full)? = checksum;
        buffer
            .get(..length.saturating_add(checksum.len()))
            .ok_or(RecordError::Full)
    }

    /// Adds the next measurement, one that the scan has taken.
    ///
    /// # Errors
    /// [`RecordError::Full`] if there are `CAPACITY` already.
    pub fn push(&mut self, measurement: Measurement) -> Result<(), RecordError> {
        self.measurements
            .push(measurement)
            .map_err(|_| RecordError::Full)
    }

    /// The measurements. A scan that takes them one after the other is where the record's was.
    #[must_use]
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// Forgets all measurements.
    pub fn clear(&mut self) {
        self.measurements.clear();
    }
}
