//! Two registers used together. Both share each load of a parameter and each load and store of a gradient entry.

use glimpse_core::numeric::Scalar;

use super::{Lanes, Octet, Octets};
use crate::operators::operators;

/// Twice the lanes of `L`.
#[derive(Clone, Copy, Debug)]
pub struct RegisterPair<L>(L, L);

operators! {
    {L: Lanes} RegisterPair<L>, a, b:
    Add add Self(a.0 + b.0, a.1 + b.1),
    Sub sub Self(a.0 - b.0, a.1 - b.1),
    Mul mul Self(a.0 * b.0, a.1 * b.1),
    Div div Self(a.0 / b.0, a.1 / b.1);
    Neg Self(-a.0, -a.1)
}

impl<L: Lanes> Scalar for RegisterPair<L> {
    type Parameter = f32;
    /// Both registers add to the same sum, so a sum needs only one register.
    type Sum = L::Sum;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self(L::constant(value), L::constant(value))
    }
    #[inline(always)]
    fn broadcast(parameter: f32) -> Self {
        Self(L::broadcast(parameter), L::broadcast(parameter))
    }
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        Self(self.0.plus_product(a.0, b.0), self.1.plus_product(a.1, b.1))
    }
    #[inline(always)]
    fn if_positive(self, then: Self, otherwise: Self) -> Self {
        let first = self.0.if_positive(then.0, otherwise.0);
        Self(first, self.1.if_positive(then.1, otherwise.1))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self(self.0.exp(), self.1.exp())
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Self(self.0.ln(), self.1.ln())
    }
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
