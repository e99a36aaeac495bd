//! The encoding of weights.

use crate::numeric::Scalar;

/// The encoding of weights, and their value as a scalar.
pub trait Encoding<S: Scalar>: Sized {
    /// One of many weights.
    type Weight: Copy;
    /// A number that there is one of for each row.
    type Number: Copy;

    /// A weight, but for the scale of its row.
    fn weight(weight: Self::Weight) -> S;
    /// A number of a row.
    fn number(number: Self::Number) -> S;

    /// Adds to each of the sums what the products of a row with `values` sum to, times the row's scale,
    /// if it has one. The rows' beginnings are `stride` weights apart.
    #[inline(always)]
    fn add_products(
        weights: &[Self::Weight],
        stride: usize,
        scales: &[Self::Number],
        values: &[S],
        sums: &mut [S],
    ) {
        let mut weights = weights;
        for (row, sum) in sums.iter_mut().enumerate() {
            let products = weights.get(..values.len()).unwrap_or_default();
            *sum = *sum + scaled::<S, Self>(dot::<S, Self>(products, values), scales, row);
            weights = weights.get(stride..).unwrap_or_default();
        }
    }

    /// The same of activations, which are from -1 to 1. In a recipe those are rounded to 1 / 32,767, which is
    /// far less than weights are rounded by.
    #[inline(always)]
    fn add_products_of_units(
        weights: &[Self::Weight],
        stride: usize,
        scales: &[Self::Number],
        units: &[S],
        sums: &mut [S],
    ) {
        Self::add_products(weights, stride, scales, units, sums);
    }
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

    // In integers: a product takes fewer cycles than to make a byte a number of each weight, and far fewer where
    // there is no FPU. Four rows at a time, so that a unit is loaded once for all of them; in a recipe each row
    // has a scale. Out of line: the code is there once.
    #[inline(never)]
    fn add_products_of_units(
        weights: &[u8],
        stride: usize,
        scales: &[[u8; 4]],
        units: &[f32],
        sums: &mut [f32],
    ) {
        let mut first = weights;
        for units in units.chunks(FIXED) {
            let mut fixed = [0; FIXED];
            for (fixed, unit) in fixed.iter_mut().zip(units) {
                *fixed = to_fixed(*unit);
            }
            let fixed = fixed.get(..units.len()).unwrap_or_default();
            let mut rows = first;
            for (sums, scales) in sums.chunks_mut(4).zip(scales.chunks(4)) {
                let row = |index: usize| {
                    let row = rows.get(stride.saturating_mul(index)..)?;
                    row.get(..fixed.len())
                };
                let Some(a) = row(0) else {
                    return;
                };
                // In place of a row that is not there stands the first one, whose sum nobody takes.
                let [b, c, d] = [1, 2, 3].map(|index| row(index).unwrap_or(a));
                let products = products_of_four([a, b, c, d], fixed);
                for ((sum, product), scale) in sums.iter_mut().zip(products).zip(scales) {
                    *sum += product as f32 * (Self::number(*scale) * (1.0 / ONE));
                }
                rows = rows.get(stride.saturating_mul(4)..).unwrap_or_default();
            }
            first = first.get(units.len()..).unwrap_or_default();
        }
    }
}

/// The sums of the products of four rows with `units`.
#[inline(always)]
fn products_of_four([a, b, c, d]: [&[u8]; 4], units: &[i16]) -> [i32; 4] {
    let product =
        |unit: i16, weight: u8| i32::from(unit).wrapping_mul(i32::from(weight.cast_signed()));
    let mut sums = [0_i32; 4];
    for ((((unit, a), b), c), d) in units.iter().zip(a).zip(b).zip(c).zip(d) {
        let [by_a, by_b, by_c, by_d] = &mut sums;
        *by_a = by_a.wrapping_add(product(*unit, *a));
        *by_b = by_b.wrapping_add(product(*unit, *b));
        *by_c = by_c.wrapping_add(product(*unit, *c));
        *by_d = by_d.wrapping_add(product(*unit, *d));
    }
    sums
}

/// Number of activations that become integers at once, and the integer of 1. The products of all of them with bytes
/// have a sum that 32 bits hold.
const FIXED: usize = 64;
const ONE: f32 = 32_767.0;
const _: () = assert!(FIXED as i64 * 128 * 32_768 < 1 << 31);

/// An activation as an integer, rounded; what is outside of -1 to 1 by more than 1 / 32,767 ends there.
#[inline(always)]
fn to_fixed(unit: f32) -> i16 {
    let half = if unit < 0.0 { -0.5 } else { 0.5 };
    ((unit * ONE + half) as i32).clamp(-0x8000, 0x7FFF) as i16
}

/// The sum of products.
#[inline(always)]
fn dot<S: Scalar, E: Encoding<S>>(weights: &[E::Weight], values: &[S]) -> S {
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
