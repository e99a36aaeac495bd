//! The operations of a register, and exp and ln on lanes, each by one polynomial.
//!
//! The tests bound the relative error of both by 3e-7; near x = 1, the bound on ln is absolute.
//! The coefficients are the minimax fits of Cephes (Moshier) in single precision.

use std::ops::{Add, Mul};

/// Numbers in one register.
pub(super) trait Register: Copy + Add<Output = Self> + Mul<Output = Self> {
    fn splat(value: f32) -> Self;
    /// Returns `self * b + c`.
    fn multiply_add(self, b: Self, c: Self) -> Self;
    /// Returns `then` where `self` > 0, and `otherwise` elsewhere.
    fn select(self, then: Self, otherwise: Self) -> Self;
    fn clamp(self, low: f32, high: f32) -> Self;
    /// Rounds to the nearest integer.
    fn round(self) -> Self;
    /// Returns 2 to the power of `self`, an integer in -126..=127.
    fn power_of_two(self) -> Self;
    /// Returns (m, e) such that self = m 2^e, m in \[sqrt(1/2), sqrt(2)); self must be positive and normal.
    fn split(self) -> (Self, Self);
}

/// Implements [`Scalar`](glimpse_core::numeric::Scalar) for a [`Register`].
macro_rules! register_scalar {
    ($register:ident, $exp:path, $ln:path) => {
        impl glimpse_core::numeric::Scalar for $register {
            type Parameter = f32;
            type Sum = Self;

            #[inline(always)]
            fn constant(value: f64) -> Self {
                Self::splat(value as f32)
            }
            #[inline(always)]
            fn broadcast(parameter: f32) -> Self {
                Self::splat(parameter)
            }
            #[inline(always)]
            fn add_product(sum: &mut Self, a: Self, b: Self) {
                *sum = a.multiply_add(b, *sum);
            }
            #[inline(always)]
            fn add_to(sum: &mut Self, a: Self) {
                *sum = *sum + a;
            }
            #[inline(always)]
            fn plus_product(self, a: Self, b: Self) -> Self {
                a.multiply_add(b, self)
            }
            #[inline(always)]
            fn if_positive(self, then: Self, otherwise: Self) -> Self {
                self.select(then, otherwise)
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
    };
}
pub(super) use register_scalar;

/// The bits of sqrt(1/2).
pub(super) const SQRT_HALF_BITS: i32 = std::f32::consts::FRAC_1_SQRT_2.to_bits() as i32;

/// ln 2 in two parts. The first has few bits, so its multiples are exact.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;

/// Evaluates a polynomial. The coefficients begin with that of the highest power.
#[inline(always)]
fn polynomial<R: Register, const N: usize>(x: R, coefficients: [f32; N]) -> R {
    let mut sum = R::splat(0.0);
    for coefficient in coefficients {
        sum = sum.multiply_add(x, R::splat(coefficient));
    }
    sum
}

/// Returns e^x. x is clamped to \[-87, 88\], so the result is a normal number.
#[inline(always)]
pub(super) fn exp<R: Register>(x: R) -> R {
    let x = x.clamp(-87.0, 88.0);
    let n = (x * R::splat(std::f32::consts::LOG2_E)).round();
    let r = n.multiply_add(R::splat(-LN_2_HIGH), x);
    let r = n.multiply_add(R::splat(-LN_2_LOW), r);
    let p = polynomial(
        r,
        [
            1.987_569_1e-4,
            1.398_2e-3,
            8.333_452e-3,
            4.166_579_6e-2,
            1.666_666_5e-1,
            5e-1,
        ],
    );
    let series = (p * r).multiply_add(r, r) + R::splat(1.0);
    series * n.power_of_two()
}

/// Returns ln x; x must be positive and normal.
#[inline(always)]
pub(super) fn ln<R: Register>(x: R) -> R {
    let (mantissa, exponent) = x.split();
    let m = mantissa + R::splat(-1.0);
    let p = polynomial(
        m,
        [
            7.037_683_6e-2,
            -1.151_461e-1,
            1.167_699_9e-1,
            -1.242_014e-1,
            1.424_932_3e-1,
            -1.666_805_7e-1,
            2.000_071_5e-1,
            -2.499_999_4e-1,
            3.333_333e-1,
        ],
    );
    let square = m * m;
    let y = p * m * square;
    let y = exponent.multiply_add(R::splat(LN_2_LOW), y);
    let y = square.multiply_add(R::splat(-0.5), y);
    exponent.multiply_add(R::splat(LN_2_HIGH), m + y)
}
