//! Scalars of the models.
//!
//! A model's loss and gradient are generic over [`Scalar`]: `f32` on the device, `f64` in tests, SIMD lanes (eight
//! samples at once) and dual numbers over lanes in the trainer.

use core::ops::{Add, Div, Mul, Neg, Sub};

use super::math;

/// An entry of a model's parameter set: plain data that threads can share.
pub trait Value: Copy + Send + Sync + 'static {}
impl<T: Copy + Send + Sync + 'static> Value for T {}

/// A number, or several numbers that are computed together.
///
/// Two associated types reduce memory traffic for wide scalars. All samples share a parameter, so it is stored as a
/// single number and [broadcast](Scalar::broadcast). An entry of a gradient is a sum over samples, so it has its own
/// accumulator.
pub trait Scalar:
    Value
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The storage of a model parameter.
    type Parameter: Value;
    /// The accumulator of an entry of a gradient.
    type Sum: Value;

    /// True if a test for zero takes less time than a product. A single number is often 0, but many numbers together
    /// hardly ever are.
    const SKIPS_ZEROS: bool = false;

    /// Returns true for 0 if [zeros are skipped](Self::SKIPS_ZEROS), otherwise false.
    #[inline(always)]
    fn is_zero(&self) -> bool {
        false
    }

    /// A constant, rounded to the scalar's precision.
    fn constant(value: f64) -> Self;
    /// A parameter, the same for all samples.
    fn broadcast(parameter: Self::Parameter) -> Self;
    /// `sum += a * b`.
    fn add_product(sum: &mut Self::Sum, a: Self, b: Self);
    /// `sum += a`.
    fn add_to(sum: &mut Self::Sum, a: Self);
    /// `sums[i][j] += a[i] * b[j]`: an outer product. One call updates several rows, so that each `b[j]` is loaded once
    /// for all of them, or skipped if it is 0.
    #[inline(always)]
    fn add_outer_product<const I: usize, const J: usize>(
        sums: [&mut [Self::Sum; J]; I],
        a: [Self; I],
        b: &[Self; J],
    ) {
        let mut sums = sums;
        for (column, b) in b.iter().enumerate() {
            if I > 1 && b.is_zero() {
                continue;
            }
            for (row, a) in sums.iter_mut().zip(&a) {
                if let Some(sum) = row.get_mut(column) {
                    Self::add_product(sum, *a, *b);
                }
            }
        }
    }
    /// `sums[i] += terms[i]`.
    #[inline(always)]
    fn add_all<const N: usize>(sums: &mut [Self::Sum; N], terms: &[Self; N]) {
        for (sum, term) in sums.iter_mut().zip(terms) {
            Self::add_to(sum, *term);
        }
    }
    /// `self + a * b`, fused if that is faster on the target.
    #[must_use]
    fn plus_product(self, a: Self, b: Self) -> Self;
    /// `if self > 0 { then } else { otherwise }`, sample by sample. Callers compute both arguments.
    #[must_use]
    fn if_positive(self, then: Self, otherwise: Self) -> Self;
    /// e to the power of `self`.
    #[must_use]
    fn exp(self) -> Self;
    /// The natural logarithm of `self` > 0.
    #[must_use]
    fn ln(self) -> Self;

    /// `max(self, 0)`.
    #[inline(always)]
    #[must_use]
    fn relu(self) -> Self {
        self.if_positive(self, Self::constant(0.0))
    }

    /// The sign: -1, 0 or 1.
    #[inline(always)]
    #[must_use]
    fn sign(self) -> Self {
        let zero = Self::constant(0.0);
        let negative = (-self).if_positive(Self::constant(-1.0), zero);
        self.if_positive(Self::constant(1.0), negative)
    }

    /// The logistic function 1 / (1 + exp(-x)), from the reals to (0, 1).
    #[inline(always)]
    #[must_use]
    fn sigmoid(self) -> Self {
        let one = Self::constant(1.0);
        one / (one + (-self).exp())
    }
}

/// A scalar with trigonometric functions.
pub trait Trigonometry: Scalar {
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
}

macro_rules! plain_scalar {
    ($type:ty, $exp:path, $ln:path, $sin_cos:path) => {
        impl Scalar for $type {
            type Parameter = Self;
            type Sum = Self;
            const SKIPS_ZEROS: bool = true;

            #[inline(always)]
            fn is_zero(&self) -> bool {
                self.to_bits() == 0
            }
            #[inline(always)]
            fn constant(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn broadcast(parameter: Self) -> Self {
                parameter
            }
            #[inline(always)]
            fn add_product(sum: &mut Self, a: Self, b: Self) {
                *sum += a * b;
            }
            #[inline(always)]
            fn add_to(sum: &mut Self, a: Self) {
                *sum += a;
            }
            #[inline(always)]
            fn plus_product(self, a: Self, b: Self) -> Self {
                self + a * b
            }
            /// Compares the bits as an integer, which takes far fewer instructions than a comparison of floats, with
            /// and without an FPU. (A NaN counts as positive if its sign bit is 0.)
            #[inline(always)]
            fn if_positive(self, then: Self, otherwise: Self) -> Self {
                if self.to_bits().cast_signed() > 0 {
                    then
                } else {
                    otherwise
                }
            }
            #[inline(always)]
            fn relu(self) -> Self {
                let sign = self.to_bits().cast_signed() >> (size_of::<Self>() * 8 - 1);
                Self::from_bits(self.to_bits() & !sign.cast_unsigned())
            }
            #[inline(always)]
            fn sign(self) -> Self {
                if self.to_bits() << 1 == 0 {
                    0.0
                } else {
                    (1.0 as Self).copysign(self)
                }
            }
            #[inline(always)]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                $ln(self)
            }
        }

        impl Trigonometry for $type {
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                $sin_cos(self)
            }
        }
    };
}

plain_scalar!(f32, math::exp, math::ln, math::sin_cos);
// Double precision is only for hosts (tests, and tables in the trainer). Devices do not link it.
#[cfg(feature = "libm")]
plain_scalar!(f64, libm::exp, libm::log, libm::sincos);

/// A single real number: f32 or f64.
pub trait Real: Scalar<Parameter = Self, Sum = Self> + PartialOrd {
    /// The number of refinement steps after each ridge solve.
    const REFINEMENTS: usize;
}

impl Real for f32 {
    const REFINEMENTS: usize = 2;
}

#[cfg(feature = "libm")]
impl Real for f64 {
    const REFINEMENTS: usize = 0;
}

/// The encoding of a number.
pub trait Stored<S>: Copy {
    /// Returns the number.
    fn value(self) -> S;
}

impl<S: Real> Stored<S> for S {
    #[inline(always)]
    fn value(self) -> S {
        self
    }
}

/// Packed little-endian f32, as recipes hold them.
impl Stored<f32> for [u8; 4] {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from_le_bytes(self)
    }
}
