//! Readings as bytes, for memory that survives a reset.
//!
//! # Format
//!
//! ```text
//! postcard( recipe: u32, readings: list of (index: u16, brdf: 3 x f32, saturated: bool) )  CRC-32
//! ```
//!
//! `recipe` is the recipe's checksum. The CRC is ISO-HDLC over the postcard bytes, little-endian. Bytes after the CRC
//! are ignored.
//!
//! All bytes are written again after each reading. The CRC detects an interrupted write or lost memory; the scan then
//! starts from the beginning.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{Reading, ReadingError};
use crate::checksum::crc_32;
use crate::recipe::Recipe;

/// Largest size of a reading in bytes: index, three numbers and a flag.
const READING_BYTES: usize = 3 + 3 * 4 + 1;
/// Largest size of the recipe's checksum, the number of readings, and the CRC, in bytes.
const OTHER_BYTES: usize = 5 + 5 + 4;

/// An error in reading or writing saved readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SavedError {
    /// The bytes hold no intact readings: none were written, or they were cut or altered.
    Damaged,
    /// The readings belong to another recipe.
    Recipe {
        /// That recipe's checksum.
        found: u32,
    },
    /// The buffer or the capacity is too small for the readings.
    Full,
    /// A reading is invalid.
    Reading(ReadingError),
}

impl core::fmt::Display for SavedError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => f.write_str("no intact readings are saved: read all samples"),
            Self::Recipe { found } => {
                write!(
                    f,
                    "the saved readings belong to the recipe {found:08x}: read all samples"
                )
            }
            Self::Full => f.write_str("too many readings: use `max_samples` and `Saved::BYTES`"),
            Self::Reading(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SavedError {}

/// The readings of a scan, in the order in which they were recorded. `CAPACITY` is the largest number of samples:
/// [`max_samples`](crate::recipe::max_samples) of the recipes.
///
/// Skipped samples are not saved: after a reset they are pending again. If [`Saved::read`] fails, for example because
/// the recipe has changed, start with [`Saved::new`].
///
/// ```
/// use glimpse_core::recipe::Recipe;
/// use glimpse_core::scan::{Reading, Saved, SavedError};
///
/// let recipe = Recipe::parse(include_bytes!("../../examples/recipes/neural-n8.recipe"))?;
/// let mut flash = [0xff; Saved::<8>::BYTES]; // erased
/// assert_eq!(Saved::<8>::read(&flash, &recipe), Err(SavedError::Damaged));
///
/// let mut saved = Saved::<8>::new(&recipe);
/// saved.insert(3, Reading::new([0.2, 0.1, 0.05]))?;
/// saved.write(&mut flash)?;
///
/// // After a reset, record these readings first.
/// let saved = Saved::<8>::read(&flash, &recipe)?;
/// assert_eq!(saved.readings(), [(3, Reading::new([0.2, 0.1, 0.05]))]);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved<const CAPACITY: usize> {
    recipe: u32,
    readings: Vec<(u16, Reading), CAPACITY>,
}

impl<const CAPACITY: usize> Saved<CAPACITY> {
    /// The largest size of the readings in bytes.
    pub const BYTES: usize = READING_BYTES
        .saturating_mul(CAPACITY)
        .saturating_add(OTHER_BYTES);

    /// Creates an empty list of readings.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>) -> Self {
        Self {
            recipe: recipe.checksum(),
            readings: Vec::new(),
        }
    }

    /// Reads the bytes of [`Saved::write`].
    ///
    /// # Errors
    /// [`SavedError`] if the bytes are damaged, belong to another recipe, or hold an invalid reading.
    pub fn read(bytes: &[u8], recipe: &Recipe<'_>) -> Result<Self, SavedError> {
        let (saved, rest) =
            postcard::take_from_bytes::<Self>(bytes).map_err(|_| SavedError::Damaged)?;
        let content = bytes.get(..bytes.len().saturating_sub(rest.len()));
        let checksum = crc_32(content.unwrap_or_default());
        match rest.first_chunk() {
            Some(written) if u32::from_le_bytes(*written) == checksum => {}
            _ => return Err(SavedError::Damaged),
        }
        if saved.recipe != recipe.checksum() {
            return Err(SavedError::Recipe {
                found: saved.recipe,
            });
        }
        for (_, reading) in &saved.readings {
            reading.check().map_err(SavedError::Reading)?;
        }
        Ok(saved)
    }

    /// Writes the readings into `buffer`, and returns the bytes used.
    ///
    /// # Errors
    /// [`SavedError::Full`] if `buffer` is too small. [`Saved::BYTES`] bytes always suffice.
    pub fn write<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], SavedError> {
        let content = postcard::to_slice(self, buffer).map_err(|_| SavedError::Full)?;
        let (length, checksum) = (content.len(), crc_32(content).to_le_bytes());
        let place = buffer.get_mut(length..).unwrap_or_default();
        *place.first_chunk_mut().ok_or(SavedError::Full)? = checksum;
        buffer
            .get(..length.saturating_add(checksum.len()))
            .ok_or(SavedError::Full)
    }

    /// Adds a reading, or replaces the one with the same index.
    ///
    /// # Errors
    /// [`SavedError::Reading`] if the reading is invalid. [`SavedError::Full`] if there are already `CAPACITY`
    /// readings.
    pub fn insert(&mut self, index: u16, reading: Reading) -> Result<(), SavedError> {
        reading.check().map_err(SavedError::Reading)?;
        if let Some((_, saved)) = self.readings.iter_mut().find(|(saved, _)| *saved == index) {
            *saved = reading;
            return Ok(());
        }
        self.readings
            .push((index, reading))
            .map_err(|_| SavedError::Full)
    }

    /// The readings, with their indices.
    #[must_use]
    pub fn readings(&self) -> &[(u16, Reading)] {
        &self.readings
    }

    /// Forgets all readings.
    pub fn clear(&mut self) {
        self.readings.clear();
    }
}
