//! The sections of a recipe, read in place.

use super::kind::Kind;

/// An iterator over the sections of a body, in order: their kinds and postcard bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sections<'a> {
    rest: &'a [u8],
}

impl<'a> Sections<'a> {
    pub(super) fn new(body: &'a [u8]) -> Self {
        Self { rest: body }
    }

    /// Returns true if no bytes are left. The iterator also ends at bytes that are not a section.
    pub(super) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }
}

impl<'a> Iterator for Sections<'a> {
    type Item = (Kind, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (section, rest) = postcard::take_from_bytes(self.rest).ok()?;
        self.rest = rest;
        Some(section)
    }
}
