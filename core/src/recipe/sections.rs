//! Lists of a recipe that are read in place.

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

/// An iterator over the training materials of a recipe: their names, and the digests of their BRDFs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Materials<'a> {
    left: u32,
    rest: &'a [u8],
}

impl<'a> Materials<'a> {
    /// Creates the list from a section's bytes. None if it is incomplete or more bytes follow.
    pub(super) fn new(bytes: &'a [u8]) -> Option<Self> {
        let (left, rest) = postcard::take_from_bytes(bytes).ok()?;
        let list = Self { left, rest };
        let mut end = list;
        (&mut end).for_each(drop);
        (end.left == 0 && end.rest.is_empty()).then_some(list)
    }
}

impl<'a> Iterator for Materials<'a> {
    type Item = (&'a str, u32);

    fn next(&mut self) -> Option<Self::Item> {
        let left = self.left.checked_sub(1)?;
        let (material, rest) = postcard::take_from_bytes(self.rest).ok()?;
        *self = Self { left, rest };
        Some(material)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.left as usize;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Materials<'_> {}
