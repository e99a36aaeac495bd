//! Lanes whose sums are single numbers, for lists of samples that fit in one register.
//!
//! Other implementations of [`Lanes`] keep one register per gradient entry, and add up its numbers after the last
//! sample. If one register holds all samples, this final addition takes longer than computing the entries. Here each
//! entry is one number instead.

use glimpse_core::numeric::{Scalar, TERMS};

use super::register::lanewise;
use super::{Lanes, Octet, Octets};

/// Lanes that are reduced to one number before they are added to a sum.
#[derive(Clone, Copy, Debug)]
pub struct ScalarSums<L>(L);

lanewise!(operators of ScalarSums: 0);

impl<L: Lanes> Scalar for ScalarSums<L> {
    type Parameter = f32;
    type Sum = f32;
    const ADDS_TERMS_TOGETHER: bool = true;

    lanewise!(methods: 0);
    #[inline(always)]
    fn add_product(sum: &mut f32, a: Self, b: Self) {
        *sum += (a.0 * b.0).total();
    }
    #[inline(always)]
    fn add_to(sum: &mut f32, a: Self) {
        *sum += a.0.total();
    }
    #[inline(always)]
    fn add_terms(sums: &mut [f32], terms: &[Self; TERMS]) {
        if sums.is_empty() {
            return;
        }
        let mut registers = [L::zero_sum(); TERMS];
        for (register, term) in registers.iter_mut().zip(terms) {
            L::add_to(register, term.0);
        }
        let mut totals = [0.0; TERMS];
        L::totals(&registers, &mut totals);
        for (sum, total) in sums.iter_mut().zip(&totals) {
            *sum += *total;
        }
    }
}

impl<L: Lanes> Lanes for ScalarSums<L> {
    const OCTETS: usize = L::OCTETS;
    type Narrow = ScalarSums<L::Narrow>;
    type Pair = Self;

    #[inline(always)]
    fn load(octets: Octets<'_>) -> Self {
        Self(L::load(octets))
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        self.0.store(octets);
    }
    #[inline(always)]
    fn zero_sum() -> f32 {
        0.0
    }
    #[inline(always)]
    fn totals(sums: &[f32], totals: &mut [f32]) {
        totals.copy_from_slice(sums);
    }
}
