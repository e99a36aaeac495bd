//! The header before the body: magic, version, length and checksum.

use super::error::RecipeError;
use super::field::Field;
use super::format::{HEADER_BYTES, MAGIC, VERSION};
use crate::checksum::crc_32_of_file;

/// A body that matches its checksum.
pub(super) struct CheckedBody<'a> {
    pub(super) checksum: u32,
    pub(super) body: &'a [u8],
}

/// Checks the header of a recipe, and returns its body.
pub(super) fn read(bytes: &[u8]) -> Result<CheckedBody<'_>, RecipeError> {
    let (magic, rest) = bytes.split_first_chunk().ok_or(RecipeError::Magic)?;
    if *magic != MAGIC {
        return Err(RecipeError::Magic);
    }
    let length_error = |expected| RecipeError::Length {
        expected,
        found: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
    };
    let too_short = length_error(HEADER_BYTES as u32);
    let (version, rest) = rest.split_first_chunk().ok_or(too_short)?;
    let (length, rest) = rest.split_first_chunk().ok_or(too_short)?;
    let (checksum, body) = rest.split_first_chunk().ok_or(too_short)?;
    let version = u16::from_le_bytes(*version);
    if version != VERSION {
        return Err(RecipeError::Version(version));
    }
    let expected = u32::from_le_bytes(*length);
    if u32::try_from(body.len()) != Ok(expected) {
        return Err(length_error(expected.saturating_add(HEADER_BYTES as u32)));
    }
    let checksum = u32::from_le_bytes(*checksum);
    if checksum != checksum_of(expected, body) {
        return Err(RecipeError::Checksum);
    }
    Ok(CheckedBody { checksum, body })
}

/// Writes the header of a recipe into `bytes`, which have room for it before the body.
pub(super) fn write(bytes: &mut [u8]) -> Result<(), RecipeError> {
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
