//! Eight lanes on AVX2 and FMA.
//!
//! Safety of every `unsafe` here: values of [`Avx2Lanes`] come to exist in [`run`] and its
//! counterpart for AVX-512 only, which are entered after the processor has been asked for AVX2
//! and FMA. The type is private to `lanes`, so nobody else can make one.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::numeric::Scalar;

use super::elementary::{self, Elementary};
use super::{Kernel, Lanes, Octet, Octets, RegisterPair, WIDTH};

#[derive(Clone, Copy)]
pub(super) struct Avx2Lanes(pub(super) __m256);

pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Runs a kernel; [`is_available`] must have said yes.
#[inline]
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn with_features<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<RegisterPair<Avx2Lanes>>()
    }
    debug_assert!(is_available());
    // SAFETY: see the file's head.
    unsafe { with_features(kernel) }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx2Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the file's head.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}
operator!(Add, add, _mm256_add_ps);
operator!(Sub, sub, _mm256_sub_ps);
operator!(Mul, mul, _mm256_mul_ps);
operator!(Div, div, _mm256_div_ps);

impl Neg for Avx2Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl Scalar for Avx2Lanes {
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
        // SAFETY: see the file's head.
        Self(unsafe {
            let mask = _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps());
            _mm256_blendv_ps(otherwise.0, then.0, mask)
        })
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

impl Lanes for Avx2Lanes {
    const OCTETS: usize = 1;
    type Narrow = Self;

    #[inline(always)]
    fn load([octet, ..]: Octets<'_>) -> Self {
        // SAFETY: see the file's head; an Octet has 32 bytes and their alignment.
        Self(unsafe { _mm256_load_ps(octet.0.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        if let Some(octet) = octets.first_mut() {
            // SAFETY: as in `load`.
            unsafe { _mm256_store_ps(octet.0.as_mut_ptr(), self.0) };
        }
    }
    #[inline(always)]
    fn zero_sum() -> Self {
        Self::splat(0.0)
    }
    #[inline(always)]
    fn totals(sums: &[Self], totals: &mut [f32]) {
        let (chunks, rest) = sums.as_chunks::<WIDTH>();
        let (outputs, tail) = totals.as_chunks_mut::<WIDTH>();
        for (sums, output) in chunks.iter().zip(outputs) {
            totals_of_eight(sums, output);
        }
        if !rest.is_empty() {
            let mut sums = [Self::splat(0.0); WIDTH];
            for (sum, rest) in sums.iter_mut().zip(rest) {
                *sum = *rest;
            }
            let mut output = [0.0; WIDTH];
            totals_of_eight(&sums, &mut output);
            for (total, output) in tail.iter_mut().zip(output) {
                *total = output;
            }
        }
    }
}

/// The sums over the lanes of eight registers: halves are added pair by pair, so that no lane is
/// taken out by itself.
#[inline(always)]
pub(super) fn totals_of_eight(sums: &[Avx2Lanes; WIDTH], totals: &mut [f32; WIDTH]) {
    let [a, b, c, d, e, f, g, h] = sums;
    // SAFETY: see the file's head; the store needs no alignment.
    unsafe {
        let ab = _mm256_hadd_ps(a.0, b.0);
        let cd = _mm256_hadd_ps(c.0, d.0);
        let ef = _mm256_hadd_ps(e.0, f.0);
        let gh = _mm256_hadd_ps(g.0, h.0);
        let abcd = _mm256_hadd_ps(ab, cd);
        let efgh = _mm256_hadd_ps(ef, gh);
        let lower = _mm256_permute2f128_ps::<0x20>(abcd, efgh);
        let upper = _mm256_permute2f128_ps::<0x31>(abcd, efgh);
        _mm256_storeu_ps(totals.as_mut_ptr(), _mm256_add_ps(lower, upper));
    }
}

impl Elementary for Avx2Lanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
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
        // SAFETY: see the file's head.
        Self(unsafe {
            _mm256_min_ps(
                _mm256_max_ps(self.0, _mm256_set1_ps(low)),
                _mm256_set1_ps(high),
            )
        })
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe {
            _mm256_round_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)
        })
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe {
            let biased = _mm256_add_epi32(_mm256_cvtps_epi32(self.0), _mm256_set1_epi32(127));
            _mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased))
        })
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        // SAFETY: see the file's head.
        unsafe {
            let bits = _mm256_castps_si256(self.0);
            let above = _mm256_sub_epi32(bits, _mm256_set1_epi32(elementary::SQRT_HALF_BITS));
            let exponent = _mm256_srai_epi32::<23>(above);
            let mantissa = _mm256_sub_epi32(bits, _mm256_slli_epi32::<23>(exponent));
            (
                Self(_mm256_castsi256_ps(mantissa)),
                Self(_mm256_cvtepi32_ps(exponent)),
            )
        }
    }
}
