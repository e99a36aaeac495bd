//! Eight lanes on AVX2 and FMA.
//!
//! Safety of every `unsafe` block in this file: [`Avx2Lanes`] values are created only in [`run`] and in its AVX-512
//! counterpart. Both run only if the processor supports AVX2 and FMA. The type is private to `lanes`, so no other code
//! can create values.

use std::arch::x86_64::*;

use super::arithmetic::arithmetic;
use super::elementary::Register;
use super::{Lanes, Octet, Octets, RegisterPair, WIDTH};

#[derive(Clone, Copy)]
pub(super) struct Avx2Lanes(pub(super) __m256);

pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

arithmetic! {
    Avx2Lanes:
    run with "avx2,fma",
    operators(Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps),
    splat _mm256_set1_ps, multiply_add _mm256_fmadd_ps,
    min _mm256_min_ps, max _mm256_max_ps, xor _mm256_xor_ps, round _mm256_round_ps,
    integers: splat _mm256_set1_epi32, add _mm256_add_epi32, sub _mm256_sub_epi32,
    shift_left _mm256_slli_epi32, shift_right _mm256_srai_epi32,
    to _mm256_cvtps_epi32, from _mm256_cvtepi32_ps,
    bits: to _mm256_castps_si256, from _mm256_castsi256_ps,
    select(value, then, otherwise) {
        let mask = _mm256_cmp_ps::<_CMP_GT_OQ>(value, _mm256_setzero_ps());
        _mm256_blendv_ps(otherwise, then, mask)
    }
}

impl Lanes for Avx2Lanes {
    const OCTETS: usize = 1;
    type Narrow = Self;
    type Pair = RegisterPair<Self>;

    #[inline(always)]
    fn load([octet, ..]: Octets<'_>) -> Self {
        // SAFETY: see the module documentation; an `Octet` has a size and an alignment of 32 bytes.
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
        lane_totals(sums, totals);
    }
}

/// Registers that can be reduced to eight lanes.
pub(super) trait Reduce: Copy {
    /// Adds the lanes beyond the eighth to the first eight.
    fn fold(self) -> Avx2Lanes;
}

impl Reduce for Avx2Lanes {
    #[inline(always)]
    fn fold(self) -> Self {
        self
    }
}

/// Computes the sum over the lanes of each register. Each register is first folded to eight lanes.
#[inline(always)]
pub(super) fn lane_totals(sums: &[impl Reduce], totals: &mut [f32]) {
    let (chunks, rest) = sums.as_chunks::<WIDTH>();
    let (outputs, tail) = totals.as_chunks_mut::<WIDTH>();
    for (sums, output) in chunks.iter().zip(outputs) {
        eight_lane_totals(&fold_each(sums), output);
    }
    if !rest.is_empty() {
        let mut output = [0.0; WIDTH];
        eight_lane_totals(&fold_each(rest), &mut output);
        for (total, output) in tail.iter_mut().zip(output) {
            *total = output;
        }
    }
}

/// Folds each of up to eight registers. The remaining entries of the result are 0.
#[inline(always)]
fn fold_each(sums: &[impl Reduce]) -> [Avx2Lanes; WIDTH] {
    let mut folded = [Avx2Lanes::splat(0.0); WIDTH];
    for (folded, sum) in folded.iter_mut().zip(sums) {
        *folded = sum.fold();
    }
    folded
}

/// Computes the sum over the lanes of each of eight registers by pairwise horizontal additions, without extracting
/// single lanes.
#[inline(always)]
fn eight_lane_totals(sums: &[Avx2Lanes; WIDTH], totals: &mut [f32; WIDTH]) {
    let [a, b, c, d, e, f, g, h] = sums;
    // SAFETY: see the module documentation; the store needs no alignment.
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
