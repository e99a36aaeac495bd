//! Readings as bytes that can be kept where a reset leaves them.
//!
//! # Format
//!
//! ```text
//! postcard( recipe: u32, readings: list of (index: u16, brdf: 3 x f32, saturated: bool) )  CRC-32
//! ```
//!
//! The recipe is named by its checksum. The CRC is ISO-HDLC over the postcard bytes,
//! little-endian; what follows it in memory does not matter.
//!
//! All of it is written anew after each reading. If that is cut short, or the memory has lost what
//! it held, the CRC says so, and the scan begins afresh.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{Reading, ReadingError};
use crate::checksum::crc_32;
use crate::recipe::Recipe;

/// Bytes of a reading: index, three numbers and a flag.
const READING_BYTES: usize = 3 + 3 * 4 + 1;
/// Bytes of the recipe's checksum and of the number of readings, at most, and of the CRC.
const OTHER_BYTES: usize = 5 + 5 + 4;

/// Errors of saved readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SavedError {
    /// No whole readings are there: nothing was written, or it was cut short or altered.
    Damaged,
    /// They are by another recipe.
    Recipe {
        /// That recipe's checksum.
        found: u32,
    },
    /// There is no room for so many readings.
    Full,
    /// It cannot be a reading.
    Reading(ReadingError),
}

impl core::fmt::Display for SavedError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Damaged => f.write_str("no whole readings are saved"),
            Self::Recipe { found } => {
                write!(f, "the saved readings are by the recipe {found:08x}")
            }
            Self::Full => f.write_str("there is no room for so many readings"),
            Self::Reading(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SavedError {}

/// The readings of a scan, in the order in which they were recorded. `CAPACITY` is the largest number of samples:
/// [`max_samples`](crate::recipe::max_samples) of the recipes.
///
/// Skipped samples are not saved: after a reset they are pending again. If [`Saved::read`] fails, also because the
/// recipe has changed, start with [`Saved::new`].
///
/// ```
/// use glimpse_core::recipe::Recipe;
/// use glimpse_core::scan::{Reading, Saved, SavedError};
///
/// let recipe = Recipe::parse(include_bytes!("../../examples/recipes/neural-n8.recipe"))?;
/// let mut flash = [0xff; Saved::<8>::BYTES]; // as it is before anything is written
/// assert_eq!(Saved::<8>::read(&flash, &recipe), Err(SavedError::Damaged));
///
/// let mut saved = Saved::<8>::new(&recipe);
/// saved.insert(3, Reading::new([0.2, 0.1, 0.05]))?;
/// saved.write(&mut flash)?;
///
/// // After a reset the scan records them first.
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
    /// The most bytes that they take.
    pub const BYTES: usize = READING_BYTES
        .saturating_mul(CAPACITY)
        .saturating_add(OTHER_BYTES);

    /// Nothing was read yet.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>) -> Self {
        Self {
            recipe: recipe.checksum(),
            readings: Vec::new(),
        }
    }

    /// Reads what [`Saved::write`] wrote.
    ///
    /// # Errors
    /// If they are not whole, by another recipe, or hold what cannot be a reading.
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

    /// Writes them into `buffer` and returns the bytes used.
    ///
    /// # Errors
    /// [`SavedError::Full`] if `buffer` has no room; [`Saved::BYTES`] always suffice.
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
    /// [`SavedError::Reading`] if it cannot be one, [`SavedError::Full`] if there are `CAPACITY`
    /// already.
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
