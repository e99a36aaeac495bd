//! The packed numbers of recipes.

use serde::{Deserialize, Serialize, Serializer};

/// A list of f32, packed as little-endian bytes, read in place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub struct Floats<'a>(&'a [u8]);

impl<'a> Floats<'a> {
    /// Creates a list.
    #[must_use]
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Returns true if the list has this number of entries, and no incomplete one.
    #[must_use]
    pub const fn has_length(&self, length: usize) -> bool {
        self.0.len() == length.saturating_mul(4)
    }

    /// The packed numbers.
    #[must_use]
    pub const fn words(&self) -> &'a [[u8; 4]] {
        self.0.as_chunks().0
    }

    /// Number of entries.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.words().len()
    }

    /// Returns true if the list is empty.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The entry with this index, or 0 after the end.
    #[must_use]
    pub fn get(&self, index: usize) -> f32 {
        let word = self.words().get(index).copied().unwrap_or_default();
        f32::from_le_bytes(word)
    }

    /// The numbers in groups of three, in order.
    pub fn triples(&self) -> impl ExactSizeIterator<Item = [f32; 3]> + Clone + 'a {
        let (triples, _) = self.words().as_chunks();
        triples.iter().map(|triple| triple.map(f32::from_le_bytes))
    }

    /// The numbers, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + Clone + 'a {
        self.words().iter().map(|word| f32::from_le_bytes(*word))
    }
}

impl Serialize for Floats<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            return serializer.collect_seq(self.iter());
        }
        serializer.serialize_bytes(self.0)
    }
}
