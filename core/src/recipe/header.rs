//! The header of a recipe, and the memory of a scan, which it states.

use crate::error::{Error, ErrorCode};
use crate::file::{FileFormat, HEADER_BYTES};

/// The header of a recipe.
pub const FORMAT: FileFormat = FileFormat {
    magic: *b"GLMP",
    version: 4,
    min_body_bytes: SECTIONS_START - HEADER_BYTES,
    errors: [
        ErrorCode::RecipeMagic,
        ErrorCode::RecipeVersion,
        ErrorCode::RecipeLength,
        ErrorCode::RecipeChecksum,
    ],
};
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
    let (checksum, mut body) = FORMAT.read(bytes)?;
    Ok(CheckedBody {
        checksum,
        samples: body.u16(),
        words: body.u32(),
        sections: body.0,
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
    let mut largest = 0;
    let mut recipes = recipes;
    while let [recipe, rest @ ..] = recipes {
        recipes = rest;
        let words = match recipe.first_chunk::<SECTIONS_START>() {
            Some([b'G', b'L', b'M', b'P', version, 0, .., a, b, c, d])
                if *version == FORMAT.version as u8 =>
            {
                u32::from_le_bytes([*a, *b, *c, *d]) as usize
            }
            _ => usize::MAX,
        };
        if words > largest {
            largest = words;
        }
    }
    largest
}
