//! Postcard decoding of a section.

use serde::Deserialize;

use super::error::RecipeError;
use super::kind::Kind;

/// Decodes a section as one value that takes all of its bytes.
pub(super) fn decode<'a, T: Deserialize<'a>>(
    kind: Kind,
    bytes: &'a [u8],
) -> Result<T, RecipeError> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        _ => Err(RecipeError::Section(kind)),
    }
}
