//! What all lanes do, and what runs on them.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

use super::octet::{MOST_OCTETS, Octet, OctetAt, Octets};

/// Work that is written over lanes.
pub trait Kernel {
    /// What it computes.
    type Output;
    /// Computes it; must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Numbers in one or two registers: eight, or a multiple of it.
pub trait Lanes: Scalar<Parameter = f32> {
    /// How many octets there are.
    const OCTETS: usize;
    /// Lanes for lists that are too short for these; itself if there are none.
    type Narrow: Lanes;

    /// From memory.
    fn load(octets: Octets<'_>) -> Self;
    /// To memory, as far as there is room.
    fn store(self, octets: &mut [Octet]);
    /// A sum of nothing.
    fn zero_sum() -> Self::Sum;
    /// The sum over all lanes of each of `sums`, always in the same order.
    fn totals(sums: &[Self::Sum], totals: &mut [f32]);

    /// The sum over the lanes.
    #[inline(always)]
    fn total(self) -> f32 {
        let mut sum = [Self::zero_sum()];
        Self::add_to(&mut sum[0], self);
        let mut total = [0.0];
        Self::totals(&sum, &mut total);
        total[0]
    }
}

/// The narrowest lanes below `L`.
pub type Narrowest<L> = <<L as Lanes>::Narrow as Lanes>::Narrow;

/// Whether there are narrower lanes than `L`.
#[must_use]
pub const fn narrows<L: Lanes>() -> bool {
    Narrowest::<L>::OCTETS < L::OCTETS
}

/// Whether there are narrower lanes, and still narrower ones.
#[must_use]
pub const fn narrows_twice<L: Lanes>() -> bool {
    Narrowest::<L>::OCTETS < L::Narrow::OCTETS
}

/// Loads half and difference vectors.
#[inline(always)]
pub fn load_at<L: Lanes>([a, b, c, d]: [&OctetAt; MOST_OCTETS]) -> HalfDifference<L> {
    HalfDifference {
        hx: L::load([&a.hx, &b.hx, &c.hx, &d.hx]),
        hz: L::load([&a.hz, &b.hz, &c.hz, &d.hz]),
        dx: L::load([&a.dx, &b.dx, &c.dx, &d.dx]),
        dy: L::load([&a.dy, &b.dy, &c.dy, &d.dy]),
        dz: L::load([&a.dz, &b.dz, &c.dz, &d.dz]),
    }
}
