//! Two registers used together. Both share each load of a parameter and each load and store of a gradient entry.

use std::ops::{Add, Div, Mul, Neg, Sub};

use glimpse_core::numeric::Scalar;

use super::{Lanes, Octet, Octets};

/// Twice the lanes of `L`.
#[derive(Clone, Copy, Debug)]
pub struct RegisterPair<L>(L, L);

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<L: Lanes> $trait for RegisterPair<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $operator other.0, self.1 $operator other.1)
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl<L: Lanes> Neg for RegisterPair<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
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
        let both = L::broadcast(parameter);
        Self(both, both)
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
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        Self(self.0.plus_product(a.0, b.0), self.1.plus_product(a.1, b.1))
    }
    #[inline(always)]
    fn if_positive(self, then: Self, otherwise: Self) -> Self {
        Self(
            self.0.if_positive(then.0, otherwise.0),
            self.1.if_positive(then.1, otherwise.1),
        )
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self(self.0.exp(), self.1.exp())
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Self(self.0.ln(), self.1.ln())
    }
}

impl<L: Lanes> Lanes for RegisterPair<L> {
    const OCTETS: usize = 2 * L::OCTETS;
    type Narrow = L;

    #[inline(always)]
    fn load([a, b, c, d]: Octets<'_>) -> Self {
        // `L::load` reads only the first `L::OCTETS` octets of its argument; the others are fillers.
        let second = match L::OCTETS {
            1 => [b, b, b, b],
            _ => [c, d, d, d],
        };
        Self(L::load([a, b, b, b]), L::load(second))
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
