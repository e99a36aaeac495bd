//! Sixteen lanes on AVX-512.
//!
//! Safety of every `unsafe` block in this file: [`Avx512Lanes`] values are created only in [`run`], which runs only if
//! the processor supports AVX-512 (F, DQ and VL). The type is private to `lanes`, so no other code can create values.

use std::arch::x86_64::*;

use super::arithmetic::arithmetic;
use super::avx2::{self, Avx2Lanes, Reduce};
use super::elementary::Register;
use super::{Lanes, Octet, Octets, RegisterPair};

#[derive(Clone, Copy)]
pub(super) struct Avx512Lanes(__m512);

pub(super) fn is_available() -> bool {
    avx2::is_available()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

arithmetic! {
    Avx512Lanes:
    run with "avx2,fma,avx512f,avx512dq,avx512vl",
    operators(Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps),
    splat _mm512_set1_ps, multiply_add _mm512_fmadd_ps,
    min _mm512_min_ps, max _mm512_max_ps, xor _mm512_xor_ps, round _mm512_roundscale_ps,
    integers: splat _mm512_set1_epi32, add _mm512_add_epi32, sub _mm512_sub_epi32,
    shift_left _mm512_slli_epi32, shift_right _mm512_srai_epi32,
    to _mm512_cvtps_epi32, from _mm512_cvtepi32_ps,
    bits: to _mm512_castps_si512, from _mm512_castsi512_ps,
    select(value, then, otherwise) {
        let mask = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(value, _mm512_setzero_ps());
        _mm512_mask_blend_ps(mask, otherwise, then)
    }
}

impl Lanes for Avx512Lanes {
    const OCTETS: usize = 2;
    type Narrow = Avx2Lanes;
    type Pair = RegisterPair<Self>;

    #[inline(always)]
    fn load([first, second, ..]: Octets<'_>) -> Self {
        // SAFETY: see the module documentation; an `Octet` has a size and an alignment of 32 bytes.
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
        avx2::lane_totals(sums, totals);
    }
}

impl Reduce for Avx512Lanes {
    #[inline(always)]
    fn fold(self) -> Avx2Lanes {
        // SAFETY: see the module documentation.
        unsafe {
            let upper = _mm512_extractf32x8_ps::<1>(self.0);
            Avx2Lanes(_mm256_add_ps(_mm512_castps512_ps256(self.0), upper))
        }
    }
}
