//! A section's value by postcard.

use serde::Deserialize;

use super::error::RecipeError;
use super::kind::Kind;

/// All of a section's bytes as one value.
pub(super) fn decode<'a, T: Deserialize<'a>>(
    kind: Kind,
    bytes: &'a [u8],
) -> Result<T, RecipeError> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        _ => Err(RecipeError::Section(kind)),
    }
}
