//! The header of a recipe, and the memory of a scan, which it states.

use crate::checksum::crc_32_of_file;
use crate::error::{Error, ErrorCode};

/// The first bytes of every recipe.
pub const MAGIC: [u8; 4] = *b"GLMP";
/// The only format version that this crate reads.
pub const VERSION: u16 = 4;
/// Number of bytes before the body.
pub const HEADER_BYTES: usize = 14;
/// Number of bytes before the sections: the header, samples (u16) and memory words (u32).
pub const SECTIONS_START: usize = HEADER_BYTES + 6;

/// A body that matches its checksum.
pub(super) struct CheckedBody<'a> {
    pub(super) checksum: u32,
    pub(super) samples: u16,
    pub(super) words: u32,
    pub(super) sections: &'a [u8],
}

/// Checks the header of a recipe, and returns its body.
pub(super) fn read(bytes: &[u8]) -> Result<CheckedBody<'_>, Error> {
    let (magic, rest) = bytes
        .split_first_chunk()
        .ok_or(Error::new(ErrorCode::RecipeMagic))?;
    if *magic != MAGIC {
        return Err(Error::new(ErrorCode::RecipeMagic));
    }
    let length_error = |expected| {
        let found = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        Error::with(ErrorCode::RecipeLength, [expected, found])
    };
    let too_short = length_error(SECTIONS_START as u32);
    let (version, rest) = rest.split_first_chunk().ok_or(too_short)?;
    let (length, rest) = rest.split_first_chunk().ok_or(too_short)?;
    let (checksum, body) = rest.split_first_chunk().ok_or(too_short)?;
    let version = u16::from_le_bytes(*version);
    if version != VERSION {
        let code = ErrorCode::RecipeVersion;
        return Err(Error::with(code, [version.into(), 0]));
    }
    let expected = u32::from_le_bytes(*length);
    if u32::try_from(body.len()) != Ok(expected) {
        return Err(length_error(expected.saturating_add(HEADER_BYTES as u32)));
    }
    let checksum = u32::from_le_bytes(*checksum);
    if checksum != crc_32_of_file(VERSION, expected, body) {
        return Err(Error::new(ErrorCode::RecipeChecksum));
    }
    let (samples, rest) = body.split_first_chunk().ok_or(too_short)?;
    let (words, sections) = rest.split_first_chunk().ok_or(too_short)?;
    Ok(CheckedBody {
        checksum,
        samples: u16::from_le_bytes(*samples),
        words: u32::from_le_bytes(*words),
        sections,
    })
}

/// Returns the memory that a scan needs with any of these recipes, in words of 4 bytes.
///
/// Firmware calls it at compile time, for the length of an array.
///
/// ```
/// use glimpse_core::recipe::memory_words;
///
/// static RECIPE: &[u8] = include_bytes!("../../examples/recipes/phong-n8.recipe");
/// const WORDS: usize = memory_words(&[RECIPE]);
/// let memory = [0.0_f32; WORDS];
/// assert_eq!(size_of_val(&memory), 376);
/// ```
///
/// If one of them is not a recipe, the result is `usize::MAX`, and memory of that size does not compile:
///
/// ```compile_fail
/// use glimpse_core::recipe::memory_words;
///
/// let memory = [0.0_f32; memory_words(&[b"not a recipe"])];
/// ```
#[must_use]
pub const fn memory_words(recipes: &[&[u8]]) -> usize {
    largest(recipes, HEADER_BYTES + 2, 4)
}

/// Returns the largest number of `length` bytes from `start` on in the headers of recipes.
const fn largest(recipes: &[&[u8]], start: usize, length: usize) -> usize {
    let mut largest = 0;
    let mut recipes = recipes;
    while let [recipe, rest @ ..] = recipes {
        recipes = rest;
        let number = match recipe {
            [b'G', b'L', b'M', b'P', version, 0, ..] if *version == VERSION as u8 => {
                number(recipe, start, length)
            }
            _ => usize::MAX,
        };
        if number > largest {
            largest = number;
        }
    }
    largest
}

const fn number(bytes: &[u8], start: usize, length: usize) -> usize {
    let Some((_, rest)) = bytes.split_at_checked(start) else {
        return usize::MAX;
    };
    let Some((mut rest, _)) = rest.split_at_checked(length) else {
        return usize::MAX;
    };
    let mut number = 0_usize;
    while let [before @ .., last] = rest {
        number = (number << 8) | *last as usize;
        rest = before;
    }
    number
}
