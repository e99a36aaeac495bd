//! Two registers used together. Both share each load of a parameter and each load and store of a gradient entry.

use glimpse_core::numeric::Scalar;

use super::register::lanewise;
use super::{Lanes, Octet, Octets};

/// Twice the lanes of `L`.
#[derive(Clone, Copy, Debug)]
pub struct RegisterPair<L>(L, L);

lanewise!(operators of RegisterPair: 0 1);

impl<L: Lanes> Scalar for RegisterPair<L> {
    type Parameter = f32;
    /// Both registers add to the same sum, so a sum needs only one register.
    type Sum = L::Sum;

    lanewise!(methods: 0 1);
    #[inline(always)]
    fn add_product(sum: &mut L::Sum, a: Self, b: Self) {
        L::add_product(sum, a.0, b.0);
        L::add_product(sum, a.1, b.1);
    }
    #[inline(always)]
    fn add_to(sum: &mut L::Sum, a: Self) {
        L::add_to(sum, a.0 + a.1);
    }
}

impl<L: Lanes> Lanes for RegisterPair<L> {
    const OCTETS: usize = 2 * L::OCTETS;
    type Narrow = L;
    type Pair = Self;

    #[inline(always)]
    fn load(octets: Octets<'_>) -> Self {
        // `L::load` reads only the first `L::OCTETS` octets of its argument; the others are fillers.
        let mut second = octets;
        for (to, from) in second.iter_mut().zip(&octets[L::OCTETS..]) {
            *to = from;
        }
        Self(L::load(octets), L::load(second))
    }
    #[inline(always)]
    fn store(self, octets: &mut [Octet]) {
        let (first, second) = octets.split_at_mut(octets.len().min(L::OCTETS));
        self.0.store(first);
        self.1.store(second);
    }
    #[inline(always)]
    fn zero_sum() -> L::Sum {
        L::zero_sum()
    }
    #[inline(always)]
    fn totals(sums: &[L::Sum], totals: &mut [f32]) {
        L::totals(sums, totals);
    }
}
