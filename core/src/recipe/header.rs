//! What stands before the body: magic, version, length and checksum.

use super::error::RecipeError;
use super::field::Field;
use super::format::{HEADER_BYTES, MAGIC, VERSION};
use crate::checksum::crc_32_of_file;

/// A body whose bytes are those that were written.
pub(super) struct Sealed<'a> {
    pub(super) checksum: u32,
    pub(super) body: &'a [u8],
}

/// Checks the header of a recipe.
pub(super) fn open(bytes: &[u8]) -> Result<Sealed<'_>, RecipeError> {
    let (magic, rest) = bytes.split_first_chunk().ok_or(RecipeError::Magic)?;
    if *magic != MAGIC {
        return Err(RecipeError::Magic);
    }
    let short = |expected| RecipeError::Length {
        expected,
        found: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
    };
    let header = short(HEADER_BYTES as u32);
    let (version, after_version) = rest.split_first_chunk().ok_or(header)?;
    let (length, after_length) = after_version.split_first_chunk().ok_or(header)?;
    let (checksum, body) = after_length.split_first_chunk().ok_or(header)?;
    let version = u16::from_le_bytes(*version);
    if version != VERSION {
        return Err(RecipeError::Version(version));
    }
    let expected = u32::from_le_bytes(*length);
    if u32::try_from(body.len()) != Ok(expected) {
        return Err(short(expected.saturating_add(HEADER_BYTES as u32)));
    }
    let checksum = u32::from_le_bytes(*checksum);
    if checksum != checksum_of(expected, body) {
        return Err(RecipeError::Checksum);
    }
    Ok(Sealed { checksum, body })
}

/// Writes the header of a recipe whose body is there; `bytes` are both.
pub(super) fn seal(bytes: &mut [u8]) -> Result<(), RecipeError> {
    let (header, body) = bytes
        .split_first_chunk_mut::<HEADER_BYTES>()
        .ok_or(RecipeError::BufferTooSmall)?;
    let length = u32::try_from(body.len()).map_err(|_| RecipeError::Count(Field::Body))?;
    let checksum = checksum_of(length, body);
    let fields = MAGIC
        .into_iter()
        .chain(VERSION.to_le_bytes())
        .chain(length.to_le_bytes())
        .chain(checksum.to_le_bytes());
    for (byte, value) in header.iter_mut().zip(fields) {
        *byte = value;
    }
    Ok(())
}

fn checksum_of(length: u32, body: &[u8]) -> u32 {
    crc_32_of_file(VERSION, length, body)
}
