//! Sums and products of lists, and indices into arrays.

use std::iter::Sum;
use std::ops::{AddAssign, Mul};

/// Returns the dot product.
#[inline]
pub fn dot<T: Copy + Mul<Output = T> + Sum>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).map(|(a, b)| *a * *b).sum()
}

/// Adds `factor` times a list to a sum.
#[inline]
pub fn add_scaled<T: Copy + AddAssign + Mul<Output = T>, U: Copy + Into<T>>(
    sum: &mut [T],
    factor: T,
    list: &[U],
) {
    for (entry, value) in sum.iter_mut().zip(list) {
        *entry += factor * (*value).into();
    }
}

/// Returns the indices of a position in an array of this shape, whose last axis varies fastest.
pub fn indices<S: AsMut<[usize]>>(mut position: usize, mut shape: S) -> S {
    for axis in shape.as_mut().iter_mut().rev() {
        (position, *axis) = (position / *axis, position % *axis);
    }
    shape
}
