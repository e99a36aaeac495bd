//! The factorization L D L' of a symmetric positive definite matrix, in place in its packed lower triangle.
//!
//! L is unit lower triangular and D diagonal: the Cholesky factorization without square roots. Row i of the packed
//! triangle has i + 1 entries. After the factorization the last one is d_i.

use crate::numeric::Real;

/// Returns the number of entries of a packed triangle of this order.
#[must_use]
pub const fn packed_length(order: usize) -> usize {
    order * (order + 1) / 2
}

/// Returns the rows of a packed triangle.
pub(super) fn rows<S>(packed: &[S]) -> impl Iterator<Item = &[S]> {
    let mut rest = packed;
    let mut length = 0;
    core::iter::from_fn(move || {
        length += 1;
        let (row, after) = rest.split_at_checked(length)?;
        rest = after;
        Some(row)
    })
}

/// Returns the rows of a packed triangle of this order, the last one first.
fn rows_reversed<S>(packed: &[S], order: usize) -> impl Iterator<Item = &[S]> {
    let mut rest = packed;
    (1..=order).rev().map_while(move |length| {
        let (before, row) = rest.split_at_checked(rest.len().checked_sub(length)?)?;
        rest = before;
        Some(row)
    })
}

pub(super) fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    let products = a.iter().zip(b);
    products.fold(S::constant(0.0), |sum, (a, b)| sum.plus_product(*a, *b))
}

/// Adds a precision to the diagonal of row `index` of a matrix, and overwrites the row with the row of its factors. The
/// rows above must be factorized.
///
/// A pivot that is below the precision or NaN becomes the precision.
pub fn factorize_row<S: Real>(packed: &mut [S], index: usize, precision: S) {
    let Some((above, rest)) = packed.split_at_mut_checked(packed_length(index)) else {
        return;
    };
    let row = rest.get_mut(..=index).unwrap_or_default();
    let Some((pivot, row)) = row.split_last_mut() else {
        return;
    };
    *pivot = *pivot + precision;
    // First compute the row of L D. Each entry depends only on entries to its left.
    for (column, above) in rows(above).enumerate() {
        if let (Some((left, [entry, ..])), Some((_, factors))) =
            (row.split_at_mut_checked(column), above.split_last())
        {
            *entry = *entry - dot(left, factors);
        }
    }
    // Then divide by D, for the row of L.
    for (entry, above) in row.iter_mut().zip(rows(above)) {
        if let Some(divisor) = above.last() {
            let scaled = *entry / *divisor;
            *pivot = *pivot - *entry * scaled;
            *entry = scaled;
        }
    }
    let is_valid = *pivot >= precision; // false for a NaN
    if !is_valid {
        *pivot = precision;
    }
}

/// Adds a row's outer product with itself, times `factor`, to a packed triangle.
pub fn add_outer_product<S: Real>(
    packed: &mut [S],
    row: impl Iterator<Item = S> + Clone,
    factor: S,
) {
    let mut rest = packed;
    for (k, left) in row.clone().enumerate() {
        let Some((line, after)) =
            core::mem::take(&mut rest).split_at_mut_checked(k.saturating_add(1))
        else {
            return;
        };
        rest = after;
        let left = left * factor;
        for (sum, right) in line.iter_mut().zip(row.clone()) {
            *sum = sum.plus_product(left, right);
        }
    }
}

/// Solves L D L' x = b. `x` holds b before the call, and x after it.
pub fn solve<S: Real>(packed: &[S], x: &mut [S]) {
    for (index, row) in rows(packed).enumerate().take(x.len()) {
        if let (Some((before, [entry, ..])), Some((_, factors))) =
            (x.split_at_mut_checked(index), row.split_last())
        {
            *entry = *entry - dot(before, factors);
        }
    }
    for (entry, row) in x.iter_mut().zip(rows(packed)) {
        if let Some(pivot) = row.last() {
            *entry = *entry / *pivot;
        }
    }
    let mut rest = x;
    for row in rows_reversed(packed, rest.len()) {
        let (Some((entry, before)), Some((_, factors))) = (
            core::mem::take(&mut rest).split_last_mut(),
            row.split_last(),
        ) else {
            break;
        };
        for (other, factor) in before.iter_mut().zip(factors) {
            *other = *other - *factor * *entry;
        }
        rest = before;
    }
}
