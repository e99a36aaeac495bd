//! The encoding of weights.

use crate::numeric::Scalar;

/// An encoding of weights, which converts them to scalars.
pub trait Encoding<S: Scalar>: Copy {
    /// An entry of a weight matrix.
    type Weight: Copy;
    /// A bias or a scale of a row.
    type Number: Copy;

    /// Converts a weight, without the scale of its row.
    fn weight(weight: Self::Weight) -> S;
    /// Converts a bias or a scale.
    fn number(number: Self::Number) -> S;

    /// Adds the dot product of a row with `values`, times the row's scale, to each sum. The starts of rows are `stride`
    /// weights apart.
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

    /// Does the same with activations, which are from -1 to 1.
    ///
    /// In a recipe they are rounded to a multiple of 1 / 32,767, which is far finer than the rounding of weights.
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

/// The encoding in training: parameters of the scalar.
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

/// The encoding in recipes: weights as signed bytes, numbers as little-endian f32.
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

    // Uses integers, because a product takes fewer cycles than the conversion of each weight to a float, and far fewer
    // without an FPU. Four rows at a time share the load of a unit. In a recipe each row has a scale. Not inlined, so
    // that the code exists once.
    #[inline(never)]
    fn add_products_of_units(
        weights: &[u8],
        stride: usize,
        scales: &[[u8; 4]],
        units: &[f32],
        sums: &mut [f32],
    ) {
        let mut columns = weights;
        for units in units.chunks(CHUNK) {
            let mut fixed = [0; CHUNK];
            for (fixed, unit) in fixed.iter_mut().zip(units) {
                *fixed = to_fixed(*unit);
            }
            let fixed = fixed.get(..units.len()).unwrap_or_default();
            let mut rows = columns;
            for (sums, scales) in sums.chunks_mut(4).zip(scales.chunks(4)) {
                let row = |index: usize| {
                    let row = rows.get(stride.saturating_mul(index)..)?;
                    row.get(..fixed.len())
                };
                let Some(a) = row(0) else {
                    return;
                };
                // The first row replaces absent ones, whose sums are unused.
                let [b, c, d] = [1, 2, 3].map(|index| row(index).unwrap_or(a));
                let products = products_of_four([a, b, c, d], fixed);
                for ((sum, product), scale) in sums.iter_mut().zip(products).zip(scales) {
                    *sum += product as f32 * (Self::number(*scale) * (1.0 / ONE));
                }
                rows = rows.get(stride.saturating_mul(4)..).unwrap_or_default();
            }
            columns = columns.get(units.len()..).unwrap_or_default();
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

/// Number of activations that are converted to integers at a time. The sum of their products with bytes fits 32 bits.
const CHUNK: usize = 64;
/// The fixed-point representation of 1.
const ONE: f32 = 32_767.0;
const _: () = assert!(CHUNK as i64 * 128 * 32_768 < 1 << 31);

/// Rounds an activation to fixed point. Values are clamped to the range of `i16`, which is -1 - 1 / 32,767 to 1.
#[inline(always)]
fn to_fixed(unit: f32) -> i16 {
    let half = if unit < 0.0 { -0.5 } else { 0.5 };
    ((unit * ONE + half) as i32).clamp(-0x8000, 0x7FFF) as i16
}

/// Returns the dot product of weights and values.
#[inline(always)]
fn dot<S: Scalar, E: Encoding<S>>(weights: &[E::Weight], values: &[S]) -> S {
    let mut sum = S::constant(0.0);
    for (weight, value) in weights.iter().zip(values) {
        sum = sum.plus_product(*value, E::weight(*weight));
    }
    sum
}

/// Multiplies a row's sum by the row's scale, if it has one.
#[inline(always)]
pub(super) fn scaled<S: Scalar, E: Encoding<S>>(sum: S, scales: &[E::Number], row: usize) -> S {
    match scales.get(row) {
        Some(scale) => sum * E::number(*scale),
        None => sum,
    }
}
