//! Lanes as plain arrays, for any machine. The compiler vectorizes them where it can.

use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::numeric::Scalar;

use super::elementary::{self, Elementary};
use super::{Lanes, Octet, Octets};

/// Eight numbers in an array.
#[derive(Clone, Copy, Debug)]
pub struct PortableLanes(Octet);

/// Evaluates an expression for each lane.
///
/// This is a macro because a closure would not always be inlined. It is unrolled by hand because the compiler would
/// spend most of a build on unrolling thousands of loops in a kernel.
macro_rules! each {
    ($lane:ident => $value:expr) => {
        each!($lane => $value, 0 1 2 3 4 5 6 7)
    };
    ($lane:ident => $value:expr, $($index:literal)*) => {
        PortableLanes(Octet([$({
            let $lane: usize = $index;
            $value
        }),*]))
    };
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for PortableLanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                each!(lane => self.0.0[lane] $operator other.0.0[lane])
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Neg for PortableLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(lane => -self.0.0[lane])
    }
}

impl Scalar for PortableLanes {
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
        *sum = sum.plus_product(a, b);
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
        each!(lane => if self.0.0[lane] > 0.0 { then.0.0[lane] } else { otherwise.0.0[lane] })
    }
    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }
}

impl Lanes for PortableLanes {
    const OCTETS: usize = 1;
    type Narrow = Self;

    #[inline(always)]
    fn load([octet, ..]: Octets<'_>) -> Self {
        Self(*octet)
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        if let Some(octet) = octets.first_mut() {
            *octet = self.0;
        }
    }
    #[inline(always)]
    fn zero_sum() -> Self {
        Self::splat(0.0)
    }
    #[inline(always)]
    fn totals(sums: &[Self], totals: &mut [f32]) {
        for (sum, total) in sums.iter().zip(totals) {
            let [a, b, c, d, e, f, g, h] = sum.0.0;
            *total = ((a + b) + (c + d)) + ((e + f) + (g + h));
        }
    }
}

impl Elementary for PortableLanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(Octet([value; super::WIDTH]))
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        // Fused only if the compilation target has the instruction; otherwise it is a slow call to `fmaf`.
        if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
            each!(lane => self.0.0[lane].mul_add(b.0.0[lane], c.0.0[lane]))
        } else {
            each!(lane => self.0.0[lane] * b.0.0[lane] + c.0.0[lane])
        }
    }
    #[inline(always)]
    fn multiply(self, b: Self) -> Self {
        self * b
    }
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self + b
    }
    #[inline(always)]
    fn clamp(self, low: f32, high: f32) -> Self {
        each!(lane => self.0.0[lane].clamp(low, high))
    }
    #[inline(always)]
    fn round(self) -> Self {
        each!(lane => self.0.0[lane].round_ties_even())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        each!(lane => f32::from_bits(((self.0.0[lane] as i32 + 127) << 23) as u32))
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let bits = |lane: usize| self.0.0[lane].to_bits() as i32;
        let exponent = |lane: usize| bits(lane).wrapping_sub(elementary::SQRT_HALF_BITS) >> 23;
        (
            each!(lane => f32::from_bits(bits(lane).wrapping_sub(exponent(lane) << 23) as u32)),
            each!(lane => exponent(lane) as f32),
        )
    }
}
