//! L D L' of a symmetric positive definite matrix, in place in its packed lower triangle.
//!
//! L is unit lower triangular and D diagonal: Cholesky's factorization without its square roots.
//! Row i of the packed triangle has i + 1 entries; after the factorization the last one is d_i.

use super::{Real, RidgeError, is_positive};

/// Entries of a packed triangle of this order.
pub(super) const fn packed_length(order: usize) -> usize {
    order * (order + 1) / 2
}

/// The rows of a packed triangle, to be changed.
pub(super) fn rows_mut<S>(packed: &mut [S]) -> impl Iterator<Item = &mut [S]> {
    let mut rest = packed;
    let mut length = 0;
    core::iter::from_fn(move || {
        length += 1;
        let (row, after) = core::mem::take(&mut rest).split_at_mut_checked(length)?;
        rest = after;
        Some(row)
    })
}

/// The rows of a packed triangle.
fn rows<S>(packed: &[S]) -> impl Iterator<Item = &[S]> {
    let mut rest = packed;
    let mut length = 0;
    core::iter::from_fn(move || {
        length += 1;
        let (row, after) = rest.split_at_checked(length)?;
        rest = after;
        Some(row)
    })
}

/// The rows of a packed triangle of this order, the last one first.
fn rows_back<S>(packed: &[S], order: usize) -> impl Iterator<Item = &[S]> {
    let mut rest = packed;
    (1..=order).rev().map_while(move |length| {
        let (before, row) = rest.split_at_checked(rest.len().checked_sub(length)?)?;
        rest = before;
        Some(row)
    })
}

fn dot<S: Real>(a: &[S], b: &[S]) -> S {
    let products = a.iter().zip(b);
    products.fold(S::constant(0.0), |sum, (a, b)| sum.plus_product(*a, *b))
}

/// Overwrites a matrix with its factors.
///
/// Fails with the index of the first pivot that is not positive or not finite.
pub(super) fn factorize<S: Real>(packed: &mut [S], order: usize) -> Result<(), RidgeError> {
    for index in 0..order {
        let Some((done, rest)) = packed.split_at_mut_checked(packed_length(index)) else {
            break;
        };
        let Some((row, pivot)) = rest
            .get_mut(..=index)
            .and_then(|row| row.split_last_mut())
            .map(|(pivot, row)| (row, pivot))
        else {
            break;
        };
        // First the row of L D, which needs itself only to the left.
        for (column, above) in rows(done).enumerate() {
            if let (Some((left, [entry, ..])), Some((_, factors))) =
                (row.split_at_mut_checked(column), above.split_last())
            {
                *entry = *entry - dot(left, factors);
            }
        }
        // Then divided by D it is the row of L.
        for (entry, above) in row.iter_mut().zip(rows(done)) {
            if let Some(divisor) = above.last() {
                let scaled = *entry / *divisor;
                *pivot = *pivot - *entry * scaled;
                *entry = scaled;
            }
        }
        if !is_positive(*pivot) {
            return Err(RidgeError::Pivot(index));
        }
    }
    Ok(())
}

/// Solves L D L' x = b; `x` holds b before and x after.
pub(super) fn solve<S: Real>(packed: &[S], x: &mut [S]) {
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
    for row in rows_back(packed, rest.len()) {
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
