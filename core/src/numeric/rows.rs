//! Principal components at a list of directions, one row for each direction.

use serde::{Deserialize, Serialize, Serializer};

use super::{Floats, Real};

/// The rows of a matrix Q with K columns.
pub trait Rows<S> {
    /// Returns an entry, or 0 outside of the matrix.
    fn entry(&self, row: usize, column: usize) -> S;
    /// Returns the product of a row with `x`, up to the length of `x`.
    fn dot(&self, row: usize, x: &[S]) -> S;
    /// Adds a row times `factor` to `sum`, up to the length of `sum`.
    fn add(&self, row: usize, factor: S, sum: &mut [S]);
}

/// A matrix of plain numbers: row-major entries, and the number of columns.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a, S>(pub &'a [S], pub usize);

impl<S> Matrix<'_, S> {
    fn row(&self, index: usize) -> &[S] {
        let start = index.saturating_mul(self.1);
        let end = start.saturating_add(self.1);
        self.0.get(start..end).unwrap_or_default()
    }
}

impl<S: Real> Rows<S> for Matrix<'_, S> {
    fn entry(&self, row: usize, column: usize) -> S {
        let entry = self.row(row).get(column).copied();
        entry.unwrap_or(S::constant(0.0))
    }

    fn dot(&self, row: usize, x: &[S]) -> S {
        let products = self.row(row).iter().zip(x);
        products.fold(S::constant(0.0), |sum, (entry, x)| {
            sum.plus_product(*entry, *x)
        })
    }

    fn add(&self, row: usize, factor: S, sum: &mut [S]) {
        for (sum, entry) in sum.iter_mut().zip(self.row(row)) {
            *sum = sum.plus_product(factor, *entry);
        }
    }
}

/// Components at directions in a recipe: signed bytes with a scale for each component, or f32 without scales.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(bound(deserialize = "'de: 'a"))]
pub struct PackedRows<'a> {
    /// The entries, row by row.
    pub entries: &'a [u8],
    /// The scale of each component, K; empty if the entries are f32.
    pub scales: Floats<'a>,
}

impl<'a> PackedRows<'a> {
    /// Returns true if there are `length` entries, in rows of `components`.
    pub(crate) fn has_length(&self, length: usize, components: usize) -> bool {
        match self.scales.is_empty() {
            true => Floats::new(self.entries).has_length(length),
            false => self.scales.has_length(components) && self.entries.len() == length,
        }
    }

    /// The numbers that the rows hold: the scales, or the entries.
    #[must_use]
    pub fn floats(&self) -> Floats<'a> {
        match self.scales.is_empty() {
            true => Floats::new(self.entries),
            false => self.scales,
        }
    }

    /// The rows, given the number of components.
    #[must_use]
    pub fn of(self, components: usize) -> ComponentRows<'a> {
        ComponentRows {
            packed: self,
            components,
        }
    }
}

/// In text formats, one list of the numbers that the fit uses, row by row.
impl Serialize for PackedRows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return (self.entries, self.scales).serialize(serializer);
        }
        if self.scales.is_empty() {
            return Floats::new(self.entries).serialize(serializer);
        }
        let scales = self.scales.iter().cycle();
        let entries = self.entries.iter().zip(scales);
        serializer.collect_seq(entries.map(|(byte, scale)| f32::from(byte.cast_signed()) * scale))
    }
}

/// Components at directions, read in place from a recipe.
#[derive(Clone, Copy, Debug)]
pub struct ComponentRows<'a> {
    packed: PackedRows<'a>,
    components: usize,
}

impl ComponentRows<'_> {
    /// Calls a function for the first entries of a row, each with an item of `list`.
    #[inline(always)]
    fn for_each<T>(
        &self,
        row: usize,
        list: impl Iterator<Item = T>,
        mut function: impl FnMut(f32, T),
    ) {
        let start = row.saturating_mul(self.components);
        let end = start.saturating_add(self.components);
        if self.packed.scales.is_empty() {
            let words = Floats::new(self.packed.entries).words();
            let row = words.get(start..end).unwrap_or_default();
            for (entry, item) in row.iter().zip(list) {
                function(f32::from_le_bytes(*entry), item);
            }
            return;
        }
        let row = self.packed.entries.get(start..end).unwrap_or_default();
        for ((entry, scale), item) in row.iter().zip(self.packed.scales.iter()).zip(list) {
            function(f32::from(entry.cast_signed()) * scale, item);
        }
    }
}

impl Rows<f32> for ComponentRows<'_> {
    fn entry(&self, row: usize, column: usize) -> f32 {
        let index = row.saturating_mul(self.components).saturating_add(column);
        if self.packed.scales.is_empty() {
            return Floats::new(self.packed.entries).get(index);
        }
        let entry = self.packed.entries.get(index).copied();
        f32::from(entry.unwrap_or_default().cast_signed()) * self.packed.scales.get(column)
    }

    #[inline(never)]
    fn dot(&self, row: usize, x: &[f32]) -> f32 {
        let mut sum = 0.0;
        self.for_each(row, x.iter(), |entry, x| sum += entry * x);
        sum
    }

    #[inline(never)]
    fn add(&self, row: usize, factor: f32, sum: &mut [f32]) {
        self.for_each(row, sum.iter_mut(), |entry, sum| *sum += factor * entry);
    }
}
