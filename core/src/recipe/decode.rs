//! Values by postcard: one for all of a section, or one field after the other.

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

/// The fields of a body that are not read yet, one after the other: what reads one by one is there
/// for the sections already, and takes a firmware no flash.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn next<T: Deserialize<'a>>(&mut self) -> Result<T, RecipeError> {
        let (field, rest) =
            postcard::take_from_bytes(self.0).map_err(|_| RecipeError::Malformed)?;
        self.0 = rest;
        Ok(field)
    }
}
