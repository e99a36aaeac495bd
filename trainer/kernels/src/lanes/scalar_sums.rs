//! Lanes whose sums are single numbers, for lists of samples that fit in one register.
//!
//! Other implementations of [`Lanes`] keep one register per gradient entry, and add up its numbers after the last
//! sample. If one register holds all samples, this final addition takes longer than computing the entries. Here each
//! entry is one number instead.

use glimpse_core::numeric::Scalar;

use super::register::lanewise;
use super::{Lanes, Octet, Octets, WIDTH};

/// Lanes that are reduced to one number before they are added to a sum.
#[derive(Clone, Copy, Debug)]
pub struct ScalarSums<L>(L);

lanewise!(operators of ScalarSums: 0);

/// Adds the totals of `terms` to `sums`, which has at most eight entries.
#[inline(always)]
fn add_totals<L: Lanes>(sums: &mut [f32], terms: &[L::Sum; WIDTH]) {
    let mut totals = [0.0; WIDTH];
    L::totals(terms, &mut totals);
    for (sum, total) in sums.iter_mut().zip(&totals) {
        *sum += total;
    }
}

impl<L: Lanes> Scalar for ScalarSums<L> {
    type Parameter = f32;
    type Sum = f32;
    const HAS_FAST_ADD_ALL: bool = true;

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
    fn add_outer_product<const I: usize, const J: usize>(
        sums: [&mut [f32; J]; I],
        a: [Self; I],
        b: &[Self; J],
    ) {
        for (row, a) in sums.into_iter().zip(&a) {
            for (sums, b) in row.chunks_mut(WIDTH).zip(b.chunks(WIDTH)) {
                let mut terms = [L::zero_sum(); WIDTH];
                for (term, b) in terms.iter_mut().zip(b) {
                    L::add_product(term, a.0, b.0);
                }
                add_totals::<L>(sums, &terms);
            }
        }
    }
    #[inline(always)]
    fn add_all(sums: &mut [f32], terms: &[Self]) {
        for (sums, list) in sums.chunks_mut(WIDTH).zip(terms.chunks(WIDTH)) {
            let mut terms = [L::zero_sum(); WIDTH];
            for (term, entry) in terms.iter_mut().zip(list) {
                L::add_to(term, entry.0);
            }
            add_totals::<L>(sums, &terms);
        }
    }
}

impl<L: Lanes> Lanes for ScalarSums<L> {
    const OCTETS: usize = L::OCTETS;
    type Narrow = ScalarSums<L::Narrow>;
    type Single = L::Single;

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
