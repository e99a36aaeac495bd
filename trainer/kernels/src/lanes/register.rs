//! The traits of lanes and of the kernels that run on them.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

use super::octet::{MAX_OCTETS, Octet, OctetDirections, Octets};

/// A computation, generic over lanes.
pub trait Kernel {
    /// The result.
    type Output;
    /// Runs the kernel. Implementations must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Numbers in one or two registers. Their count is a multiple of eight.
pub trait Lanes: Scalar<Parameter = f32> {
    /// The number of octets.
    const OCTETS: usize;
    /// Narrower lanes for shorter lists; `Self` if these are the narrowest.
    type Narrow: Lanes;

    /// Loads from the first [`OCTETS`](Self::OCTETS) of `octets`.
    fn load(octets: Octets<'_>) -> Self;
    /// Stores to the first [`OCTETS`](Self::OCTETS) of `octets`, or to all if there are fewer.
    fn store(self, octets: &mut [Octet]);
    /// Returns an empty sum.
    fn zero_sum() -> Self::Sum;
    /// Computes the sum over all lanes of each of `sums`. The order of additions is fixed.
    fn totals(sums: &[Self::Sum], totals: &mut [f32]);

    /// Returns the sum over the lanes.
    #[inline(always)]
    fn total(self) -> f32 {
        let mut sum = [Self::zero_sum()];
        Self::add_to(&mut sum[0], self);
        let mut total = [0.0];
        Self::totals(&sum, &mut total);
        total[0]
    }
}

/// The narrowest lanes that `L` can be replaced with: [`Lanes::Narrow`], applied twice.
pub type Narrowest<L> = <<L as Lanes>::Narrow as Lanes>::Narrow;

/// Returns true if there are narrower lanes than `L`.
#[must_use]
pub const fn has_narrower<L: Lanes>() -> bool {
    Narrowest::<L>::OCTETS < L::OCTETS
}

/// Returns true if there are two narrower widths than `L`.
#[must_use]
pub const fn has_two_narrower<L: Lanes>() -> bool {
    Narrowest::<L>::OCTETS < L::Narrow::OCTETS
}

/// Loads half and difference vectors.
#[inline(always)]
pub fn load_directions<L: Lanes>(
    [a, b, c, d]: [&OctetDirections; MAX_OCTETS],
) -> HalfDifference<L> {
    HalfDifference {
        hx: L::load([&a.hx, &b.hx, &c.hx, &d.hx]),
        hz: L::load([&a.hz, &b.hz, &c.hz, &d.hz]),
        dx: L::load([&a.dx, &b.dx, &c.dx, &d.dx]),
        dy: L::load([&a.dy, &b.dy, &c.dy, &d.dy]),
        dz: L::load([&a.dz, &b.dz, &c.dz, &d.dz]),
    }
}
