//! How weights are kept.

use crate::numeric::Scalar;

/// How weights are kept, and read as a scalar.
pub trait Encoding<S: Scalar> {
    /// One of many weights.
    type Weight: Copy;
    /// A number that there is one of for each row.
    type Number: Copy;

    /// A weight, but for the scale of its row.
    fn weight(weight: Self::Weight) -> S;
    /// A number of a row.
    fn number(number: Self::Number) -> S;
}

/// As parameters of the scalar: in training.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl<S: Scalar> Encoding<S> for Plain {
    type Weight = S::Parameter;
    type Number = S::Parameter;

    #[inline(always)]
    fn weight(weight: S::Parameter) -> S {
        S::broadcast(weight)
    }
    #[inline(always)]
    fn number(number: S::Parameter) -> S {
        S::broadcast(number)
    }
}

/// As in recipes: weights as signed bytes, numbers as little-endian f32.
#[derive(Clone, Copy, Debug)]
pub struct Packed;

impl Encoding<f32> for Packed {
    type Weight = u8;
    type Number = [u8; 4];

    #[inline(always)]
    fn weight(weight: u8) -> f32 {
        f32::from(weight.cast_signed())
    }
    #[inline(always)]
    fn number(number: [u8; 4]) -> f32 {
        f32::from_le_bytes(number)
    }
}

/// The sum of products.
#[inline(always)]
pub(super) fn dot<S: Scalar, E: Encoding<S>>(weights: &[E::Weight], values: &[S]) -> S {
    let mut sum = S::constant(0.0);
    for (weight, value) in weights.iter().zip(values) {
        sum = sum.plus_product(*value, E::weight(*weight));
    }
    sum
}

/// A row's sum times the row's scale, if it has one.
#[inline(always)]
pub(super) fn scaled<S: Scalar, E: Encoding<S>>(sum: S, scales: &[E::Number], row: usize) -> S {
    match scales.get(row) {
        Some(scale) => sum * E::number(*scale),
        None => sum,
    }
}
