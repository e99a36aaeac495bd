//! Lanes as plain arrays, for any machine. The compiler vectorizes them where it can.

use super::elementary::{self, Register, register_scalar};
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

register_scalar!(PortableLanes);

impl Lanes for PortableLanes {
    const OCTETS: usize = 1;
    type Narrow = Self;
    type Single = Self;

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

macro_rules! operations {
    ($($method:ident $operator:tt)*) => {$(
        #[inline(always)]
        fn $method(self, b: Self) -> Self {
            each!(lane => self.0.0[lane] $operator b.0.0[lane])
        }
    )*};
}

impl Register for PortableLanes {
    operations!(plus + subtract - multiply * divide /);
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(Octet([value; super::WIDTH]))
    }
    #[inline(always)]
    fn negate(self) -> Self {
        each!(lane => -self.0.0[lane])
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        each!(lane => if self.0.0[lane] > 0.0 { then.0.0[lane] } else { otherwise.0.0[lane] })
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
