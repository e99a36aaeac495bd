//! Eight lanes for any machine: NEON on 64-bit Arm, SSE2 on x86-64.

use wide::{CmpGt, f32x8, i32x8};

use super::elementary::{self, Register, register_scalar};
use super::{Kernel, Lanes, Octet, Octets};
use crate::operators::operators;

/// Eight numbers, in as many registers as the machine needs.
#[derive(Clone, Copy, Debug)]
pub struct PortableLanes(f32x8);

register_scalar!(PortableLanes, exp, ln);

/// Runs a kernel.
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<PortableLanes>()
}

#[inline(never)]
fn exp(x: PortableLanes) -> PortableLanes {
    elementary::exp(x)
}

#[inline(never)]
fn ln(x: PortableLanes) -> PortableLanes {
    elementary::ln(x)
}

impl Lanes for PortableLanes {
    const OCTETS: usize = 1;
    type Narrow = Self;
    type Pair = Self;

    #[inline(always)]
    fn load([octet, ..]: Octets<'_>) -> Self {
        Self(f32x8::from(octet.0))
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        if let Some(octet) = octets.first_mut() {
            *octet = Octet(self.0.to_array());
        }
    }
    #[inline(always)]
    fn zero_sum() -> Self {
        Self::splat(0.0)
    }
    #[inline(always)]
    fn totals(sums: &[Self], totals: &mut [f32]) {
        for (sum, total) in sums.iter().zip(totals) {
            let [a, b, c, d, e, f, g, h] = sum.0.to_array();
            *total = ((a + b) + (c + d)) + ((e + f) + (g + h));
        }
    }
}

operators! {
    {} PortableLanes, a, b:
    Add add Self(a.0 + b.0),
    Sub sub Self(a.0 - b.0),
    Mul mul Self(a.0 * b.0),
    Div div Self(a.0 / b.0);
    Neg Self(a.0 ^ f32x8::splat(-0.0))
}

impl Register for PortableLanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(f32x8::splat(value))
    }
    /// Fused only if the compilation target has the instruction.
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_add(b.0, c.0))
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        Self(self.0.cmp_gt(f32x8::ZERO).blend(then.0, otherwise.0))
    }
    #[inline(always)]
    fn clamp(self, low: f32, high: f32) -> Self {
        // As on AVX: NaN becomes `low`.
        Self(
            self.0
                .fast_max(f32x8::splat(low))
                .fast_min(f32x8::splat(high)),
        )
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(self.0.round())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        let biased = self.0.fast_trunc_int() + i32x8::splat(127);
        Self(bytemuck::cast(biased << 23))
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let bits: i32x8 = bytemuck::cast(self.0);
        let exponent = (bits - i32x8::splat(elementary::SQRT_HALF_BITS)) >> 23;
        let mantissa = bits - (exponent << 23);
        (
            Self(bytemuck::cast(mantissa)),
            Self(f32x8::from_i32x8(exponent)),
        )
    }
}
