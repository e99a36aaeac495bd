//! How weights are kept.

use crate::numeric::Scalar;

/// How weights are kept, and read as a scalar.
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
        add_row_by_row::<S, Self>(weights, stride, scales, values, sums);
    }
}

/// Whether products are made in hardware, as far as a target's name tells. Where they are not they take
/// so long that to go round a loop counts for nothing, and the smaller code is the better one.
const HAS_FPU: bool = !cfg!(any(target_abi = "eabi", target_arch = "riscv32"));

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

    // Four rows at a time: a value is loaded once, and the loop goes round once, for all of them. In a
    // recipe each row has a scale. Out of line: the code is there once.
    #[inline(never)]
    fn add_products(
        weights: &[u8],
        stride: usize,
        scales: &[[u8; 4]],
        values: &[f32],
        sums: &mut [f32],
    ) {
        if !HAS_FPU {
            return add_row_by_row::<f32, Self>(weights, stride, scales, values, sums);
        }
        let mut weights = weights;
        for (sums, scales) in sums.chunks_mut(4).zip(scales.chunks(4)) {
            let row = |index: usize| {
                let row = weights.get(stride.saturating_mul(index)..)?;
                row.get(..values.len())
            };
            let Some(a) = row(0) else {
                return;
            };
            // In place of a row that is not there stands the first one, whose sum nobody takes.
            let (b, c, d) = (
                row(1).unwrap_or(a),
                row(2).unwrap_or(a),
                row(3).unwrap_or(a),
            );
            let [mut by_a, mut by_b, mut by_c, mut by_d] = [0.0_f32; 4];
            for ((((value, a), b), c), d) in values.iter().zip(a).zip(b).zip(c).zip(d) {
                by_a += *value * Self::weight(*a);
                by_b += *value * Self::weight(*b);
                by_c += *value * Self::weight(*c);
                by_d += *value * Self::weight(*d);
            }
            let products = &[by_a, by_b, by_c, by_d];
            for ((sum, products), scale) in sums.iter_mut().zip(products).zip(scales) {
                *sum += products * Self::number(*scale);
            }
            weights = weights.get(stride.saturating_mul(4)..).unwrap_or_default();
        }
    }
}

/// [`Encoding::add_products`], one row after the other.
#[inline(always)]
fn add_row_by_row<S: Scalar, E: Encoding<S>>(
    weights: &[E::Weight],
    stride: usize,
    scales: &[E::Number],
    values: &[S],
    sums: &mut [S],
) {
    let mut weights = weights;
    for (row, sum) in sums.iter_mut().enumerate() {
        let products = weights.get(..values.len()).unwrap_or_default();
        *sum = *sum + scaled::<S, E>(dot::<S, E>(products, values), scales, row);
        weights = weights.get(stride..).unwrap_or_default();
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
