//! A ridge problem, and the assembly of its system in the form of the smaller order.

use super::ldl::{self, packed_length};
use super::{Part, Real, RidgeError, Stored, dot};

/// Returns the number of entries of a problem's factors: r (r + 1) / 2, r = min(n, m).
#[must_use]
pub const fn factor_length(samples: usize, components: usize) -> usize {
    packed_length(order(samples, components))
}

/// Returns the scratch memory of a solve or an adjoint, in numbers: 2 m + 3 r, r = min(n, m).
#[must_use]
pub const fn scratch_length(samples: usize, components: usize) -> usize {
    2 * components + 3 * order(samples, components)
}

const fn order(samples: usize, components: usize) -> usize {
    if samples < components {
        samples
    } else {
        components
    }
}

/// A ridge problem without a right-hand side: basis A and precisions p, read in place.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, T> {
    pub(super) basis: &'a [T],
    pub(super) precision: &'a [T],
}

impl<'a, T> Problem<'a, T> {
    /// Creates the problem from the basis A (n rows of m, row-major) and m precisions.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if `precision` or `basis` is empty, or if the last row of `basis` is incomplete.
    pub fn new(basis: &'a [T], precision: &'a [T]) -> Result<Self, RidgeError> {
        let wrong_length = |part, list: &[T]| RidgeError::Length {
            part,
            found: list.len(),
        };
        match basis.len().checked_rem(precision.len()) {
            None => Err(wrong_length(Part::Precision, precision)),
            Some(0) if !basis.is_empty() => Ok(Self { basis, precision }),
            Some(_) => Err(wrong_length(Part::Basis, basis)),
        }
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.basis.len() / self.precision.len().max(1)
    }

    /// m, the number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.precision.len()
    }

    /// r = min(n, m), the order of the system that is factorized.
    #[must_use]
    pub fn order(&self) -> usize {
        order(self.samples(), self.components())
    }

    /// Returns true if the system is (A'A + P) c = A't, of order m. Otherwise it is (A P^-1 A' + I) u = t, of order n.
    pub(super) fn is_primal(&self) -> bool {
        self.components() <= self.samples()
    }

    /// Returns the rows of A.
    pub(super) fn rows(&self) -> impl Iterator<Item = &'a [T]> + Clone {
        self.basis.chunks_exact(self.precision.len().max(1))
    }

    /// Assembles and factorizes a row of the system, so that a device can pause between rows.
    ///
    /// The rows above must be factorized. `packed` and `scratch` are as for [`Problem::factorize`].
    ///
    /// It cannot fail. In exact arithmetic the pivots of (A P^-1 A' + I) are at least 1, and those of (A'A + P) are at
    /// least their precisions, because the factorization keeps what is added to the diagonal. If rounding moves a pivot
    /// below this bound, it is set to the bound.
    pub(crate) fn factorize_row<S: Real>(&self, packed: &mut [S], index: usize, scratch: &mut [S])
    where
        T: Stored<S>,
    {
        let Some((above, rest)) = packed.split_at_mut_checked(packed_length(index)) else {
            return;
        };
        let Some(row) = rest.get_mut(..=index) else {
            return;
        };
        let min_pivot = if self.is_primal() {
            self.assemble_primal(index, row)
        } else {
            self.assemble_dual(index, row, scratch);
            S::constant(1.0)
        };
        ldl::factorize_row(above, row, min_pivot);
    }

    /// Assembles a row of A'A + P, and returns its precision.
    fn assemble_primal<S: Real>(&self, index: usize, entries: &mut [S]) -> S
    where
        T: Stored<S>,
    {
        entries.fill(S::constant(0.0));
        for row in self.rows() {
            if let Some(left) = row.get(index) {
                let left = left.value();
                for (entry, right) in entries.iter_mut().zip(row) {
                    *entry = entry.plus_product(left, right.value());
                }
            }
        }
        let precision = self.precision.get(index).map(|p| p.value());
        let precision = precision.unwrap_or(S::constant(1.0));
        if let Some(diagonal) = entries.last_mut() {
            *diagonal = *diagonal + precision;
        }
        precision
    }

    /// Assembles a row of A P^-1 A' + I.
    fn assemble_dual<S: Real>(&self, index: usize, entries: &mut [S], scratch: &mut [S])
    where
        T: Stored<S>,
    {
        if let Some(row) = self.rows().nth(index) {
            for ((scaled, a), precision) in scratch.iter_mut().zip(row).zip(self.precision) {
                *scaled = a.value() / precision.value();
            }
        }
        for (entry, other) in entries.iter_mut().zip(self.rows()) {
            *entry = dot(other, scratch);
        }
        if let Some(diagonal) = entries.last_mut() {
            *diagonal = *diagonal + S::constant(1.0);
        }
    }

    /// Returns the part of a scratch buffer that a solve uses.
    pub(super) fn scratch<'s, S>(&self, scratch: &'s mut [S]) -> Result<&'s mut [S], RidgeError> {
        let needed = scratch_length(self.samples(), self.components());
        prefix(scratch, needed, Part::Scratch)
    }
}

/// Returns the first `needed` entries of a buffer.
pub(super) fn prefix<S>(buffer: &mut [S], needed: usize, part: Part) -> Result<&mut [S], RidgeError> {
    let found = buffer.len();
    buffer.get_mut(..needed).ok_or(RidgeError::Buffer {
        part,
        needed,
        found,
    })
}
