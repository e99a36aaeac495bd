//! Sixteen lanes on AVX-512.
//!
//! Safety of every `unsafe` here: values of [`Avx512Lanes`] come to exist in [`run`] only, which
//! is entered after the processor has been asked for AVX-512 (F, DQ and VL). The type is private
//! to `lanes`, so nobody else can make one.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::numeric::Scalar;

use super::avx2::{self, Avx2Lanes};
use super::elementary::{self, Elementary};
use super::{Kernel, Lanes, Octet, Octets, RegisterPair};

#[derive(Clone, Copy)]
pub(super) struct Avx512Lanes(__m512);

pub(super) fn is_available() -> bool {
    avx2::is_available()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

/// Runs a kernel; [`is_available`] must have said yes.
#[inline]
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[inline]
    #[target_feature(enable = "avx2,fma,avx512f,avx512dq,avx512vl")]
    fn with_features<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<RegisterPair<Avx512Lanes>>()
    }
    debug_assert!(is_available());
    // SAFETY: see the file's head.
    unsafe { with_features(kernel) }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx512Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the file's head.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}
operator!(Add, add, _mm512_add_ps);
operator!(Sub, sub, _mm512_sub_ps);
operator!(Mul, mul, _mm512_mul_ps);
operator!(Div, div, _mm512_div_ps);

impl Neg for Avx512Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm512_xor_ps(self.0, _mm512_set1_ps(-0.0)) })
    }
}

impl Scalar for Avx512Lanes {
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
            let mask = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps());
            _mm512_mask_blend_ps(mask, otherwise.0, then.0)
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

impl Lanes for Avx512Lanes {
    const OCTETS: usize = 2;
    type Narrow = Avx2Lanes;

    #[inline(always)]
    fn load([first, second, ..]: Octets<'_>) -> Self {
        // SAFETY: see the file's head; an Octet has 32 bytes and their alignment.
        Self(unsafe {
            let first = _mm512_castps256_ps512(_mm256_load_ps(first.0.as_ptr()));
            _mm512_insertf32x8::<1>(first, _mm256_load_ps(second.0.as_ptr()))
        })
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        // SAFETY: as in `load`.
        unsafe {
            if let Some(first) = octets.first_mut() {
                _mm256_store_ps(first.0.as_mut_ptr(), _mm512_castps512_ps256(self.0));
            }
            if let Some(second) = octets.get_mut(1) {
                _mm256_store_ps(second.0.as_mut_ptr(), _mm512_extractf32x8_ps::<1>(self.0));
            }
        }
    }
    #[inline(always)]
    fn zero_sum() -> Self {
        Self::splat(0.0)
    }
    #[inline(always)]
    fn totals(sums: &[Self], totals: &mut [f32]) {
        // Folded to eight lanes each, they go the way of AVX2's.
        let (chunks, rest) = sums.as_chunks::<8>();
        let (outputs, tail) = totals.as_chunks_mut::<8>();
        for (sums, output) in chunks.iter().zip(outputs) {
            let mut folded = [Avx2Lanes::constant(0.0); 8];
            for (folded, sum) in folded.iter_mut().zip(sums) {
                *folded = sum.fold();
            }
            avx2::totals_of_eight(&folded, output);
        }
        if !rest.is_empty() {
            let mut folded = [Avx2Lanes::constant(0.0); 8];
            for (folded, sum) in folded.iter_mut().zip(rest) {
                *folded = sum.fold();
            }
            let mut output = [0.0; 8];
            avx2::totals_of_eight(&folded, &mut output);
            for (total, output) in tail.iter_mut().zip(output) {
                *total = output;
            }
        }
    }
}

impl Avx512Lanes {
    /// Upper and lower half added.
    #[inline(always)]
    fn fold(self) -> Avx2Lanes {
        // SAFETY: see the file's head.
        unsafe {
            let upper = _mm512_extractf32x8_ps::<1>(self.0);
            Avx2Lanes(_mm256_add_ps(_mm512_castps512_ps256(self.0), upper))
        }
    }
}

impl Elementary for Avx512Lanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    fn multiply_add(self, b: Self, c: Self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe { _mm512_fmadd_ps(self.0, b.0, c.0) })
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
            _mm512_min_ps(
                _mm512_max_ps(self.0, _mm512_set1_ps(low)),
                _mm512_set1_ps(high),
            )
        })
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe {
            _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)
        })
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // SAFETY: see the file's head.
        Self(unsafe {
            let biased = _mm512_add_epi32(_mm512_cvtps_epi32(self.0), _mm512_set1_epi32(127));
            _mm512_castsi512_ps(_mm512_slli_epi32::<23>(biased))
        })
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        // SAFETY: see the file's head.
        unsafe {
            let bits = _mm512_castps_si512(self.0);
            let above = _mm512_sub_epi32(bits, _mm512_set1_epi32(elementary::SQRT_HALF_BITS));
            let exponent = _mm512_srai_epi32::<23>(above);
            let mantissa = _mm512_sub_epi32(bits, _mm512_slli_epi32::<23>(exponent));
            (
                Self(_mm512_castsi512_ps(mantissa)),
                Self(_mm512_cvtepi32_ps(exponent)),
            )
        }
    }
}
