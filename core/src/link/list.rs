//! Lists in messages.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::frame::TOO_LONG;
use super::{BYTES_PER_FRAME, VALUES_PER_FRAME};
use crate::error::Error;
#[cfg(doc)]
use crate::error::ErrorCode;

/// The values in one [`Request::Values`](super::Request::Values).
pub type Values = List<f32, VALUES_PER_FRAME>;
/// The bytes in one [`Reply::RecipePart`](super::Reply::RecipePart).
pub type RecipeBytes = List<u8, BYTES_PER_FRAME>;

/// A list of at most `N` items, stored inline.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::link::Values;
///
/// let values = Values::try_from(&[0.5, 0.25][..])?;
/// assert_eq!(values.as_slice(), [0.5, 0.25]);
/// let error = Values::try_from(&[0.0; 17][..]).unwrap_err();
/// assert_eq!(error.code, ErrorCode::FrameTooLong);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct List<T, const N: usize>(Vec<T, N>);

impl<T, const N: usize> List<T, N> {
    /// Takes items from an iterator until the list is full or the iterator ends.
    #[must_use]
    pub fn take_from(items: impl IntoIterator<Item = T>) -> Self {
        let mut list = Vec::new();
        for item in items.into_iter().take(N) {
            let _ = list.push(item); // N items always fit
        }
        Self(list)
    }

    /// The items.
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        &self.0
    }
}

impl<T: Copy, const N: usize> TryFrom<&[T]> for List<T, N> {
    type Error = Error;

    /// # Errors
    /// [`ErrorCode::FrameTooLong`] for more than `N` items.
    fn try_from(items: &[T]) -> Result<Self, Error> {
        match items.len() <= N {
            true => Ok(Self::take_from(items.iter().copied())),
            false => Err(TOO_LONG),
        }
    }
}
