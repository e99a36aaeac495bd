//! A ridge problem, and the assembly of its system in the smaller of two forms.

use super::ldl::{self, packed_length};
use super::{Part, Real, RidgeError, Stored, dot};

/// Numbers that the factors of a problem take: r (r + 1) / 2, r = min(n, m).
#[must_use]
pub const fn factor_length(samples: usize, components: usize) -> usize {
    packed_length(order(samples, components))
}

/// Numbers that a solve or an adjoint works in: 2 m + 3 r, r = min(n, m).
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

/// A ridge problem without its right side: basis A and precisions p, read in place.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, T> {
    pub(super) basis: &'a [T],
    pub(super) precision: &'a [T],
}

impl<'a, T> Problem<'a, T> {
    /// The problem with the basis A, n rows of m, row-major, and m precisions.
    ///
    /// # Errors
    /// [`RidgeError::Length`] if there is no precision, or not a whole number of rows, or none.
    pub fn new(basis: &'a [T], precision: &'a [T]) -> Result<Self, RidgeError> {
        let wrong = |part, list: &[T]| RidgeError::Length {
            part,
            found: list.len(),
        };
        match basis.len().checked_rem(precision.len()) {
            None => Err(wrong(Part::Precision, precision)),
            Some(0) if !basis.is_empty() => Ok(Self { basis, precision }),
            Some(_) => Err(wrong(Part::Basis, basis)),
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

    /// The system in its smaller form is of order m: (A'A + P) c = A't.
    pub(super) fn is_primal(&self) -> bool {
        self.components() <= self.samples()
    }

    /// The rows of A.
    pub(super) fn rows(&self) -> impl Iterator<Item = &'a [T]> + Clone {
        self.basis.chunks_exact(self.precision.len().max(1))
    }

    /// Assembles a row of the system and factorizes it, the rows above being done: so that a
    /// device can stop between two of them. `packed` and `scratch` are as for
    /// [`Problem::factorize`].
    ///
    /// It cannot fail: in exact arithmetic no pivot is below 1, or, of (A'A + P), below its own
    /// precision, since what is added to the diagonal stays there; one that rounding has brought
    /// below is put there.
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
        let least = if self.is_primal() {
            self.assemble_primal(index, row)
        } else {
            self.assemble_dual(index, row, scratch);
            S::constant(1.0)
        };
        ldl::factorize_row(above, row, least);
    }

    /// A row of A'A + P; returns its precision.
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

    /// A row of A P^-1 A' + I.
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

    /// The part of a buffer that a solve works in.
    pub(super) fn scratch<'s, S>(&self, scratch: &'s mut [S]) -> Result<&'s mut [S], RidgeError> {
        let needed = scratch_length(self.samples(), self.components());
        take(scratch, needed, Part::Scratch)
    }
}

/// The first `needed` entries of a buffer.
pub(super) fn take<S>(buffer: &mut [S], needed: usize, part: Part) -> Result<&mut [S], RidgeError> {
    let found = buffer.len();
    buffer.get_mut(..needed).ok_or(RidgeError::Buffer {
        part,
        needed,
        found,
    })
}
