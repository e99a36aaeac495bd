//! Principal components at a list of directions, read in place from a recipe.

use crate::numeric::Floats;

/// Principal components at a list of directions: a row of signed bytes for each direction, and a factor for each
/// component.
#[derive(Clone, Copy, Debug)]
pub struct ComponentRows<'a> {
    pub(crate) rows: &'a [u8],
    pub(crate) scales: Floats<'a>,
}

impl<'a> ComponentRows<'a> {
    /// The rows of all directions: for each direction a signed byte for each component.
    #[must_use]
    pub fn rows(&self) -> &'a [u8] {
        self.rows
    }

    /// The factor of each component.
    #[must_use]
    pub fn scales(&self) -> Floats<'a> {
        self.scales
    }

    /// The components at a direction.
    pub(super) fn row(&self, index: usize) -> impl Iterator<Item = f32> + Clone {
        let row = self.rows.chunks_exact(self.scales.len().max(1)).nth(index);
        let entries = row.unwrap_or_default().iter().zip(self.scales.iter());
        entries.map(|(entry, scale)| f32::from(entry.cast_signed()) * scale)
    }

    /// Returns `center` plus the sum of the components at a direction times their coefficients.
    ///
    /// Not inlined, so that firmware contains it once and its stack is released afterwards.
    #[inline(never)]
    pub(super) fn combine(&self, index: usize, center: f32, coefficients: &[f32]) -> f32 {
        let products = self.row(index).zip(coefficients);
        products.fold(center, |sum, (entry, a)| sum + entry * a)
    }
}
