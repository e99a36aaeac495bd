//! The packed numbers of recipes.

/// A list of f32, packed as little-endian bytes, read in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Floats<'a>(&'a [[u8; 4]]);

impl<'a> Floats<'a> {
    /// The empty list.
    pub const EMPTY: Self = Self(&[]);

    /// Creates a list. None if the length is not a multiple of four.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        match bytes.as_chunks() {
            (words, []) => Some(Self(words)),
            _ => None,
        }
    }

    /// The packed numbers.
    #[must_use]
    pub fn words(&self) -> &'a [[u8; 4]] {
        self.0
    }

    /// Number of entries.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if the list is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Splits off the first `count` numbers, or all of them if there are fewer.
    #[must_use]
    pub fn take(&mut self, count: usize) -> Self {
        let (first, rest) = self.0.split_at_checked(count).unwrap_or((self.0, &[]));
        self.0 = rest;
        Self(first)
    }

    /// The numbers, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + Clone + 'a {
        self.0.iter().map(|word| f32::from_le_bytes(*word))
    }
}
