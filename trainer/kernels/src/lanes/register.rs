//! The traits of lanes and of the kernels that run on them.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::numeric::Scalar;

use super::octet::{MAX_OCTETS, Octet, OctetDirections, Octets};

/// A computation, generic over lanes.
pub trait Kernel {
    /// The result.
    type Output;
    /// Runs the kernel. Implementations must be `#[inline(always)]`.
    fn run<L: OneRegister>(self) -> Self::Output;
}

/// Defines a function that is compiled for each instruction set. Its body is generic over lanes, its first type
/// parameter; callers do not give it. The expression after `on` is the [`InstructionSet`](super::InstructionSet) to run
/// on.
macro_rules! kernel {
    (
        on $set:expr;
        $(#[$attribute:meta])*
        $visibility:vis fn $name:ident<$a:lifetime, $lanes:ident: $lanes_bound:ident $(, $generic:ident: $bound:ident)*>(
            $($argument:ident: $type:ty),* $(,)?
        ) $(-> $output:ty)? $body:block
    ) => {
        $(#[$attribute])*
        $visibility fn $name<$a $(, $generic: $bound)*>($($argument: $type),*) $(-> $output)? {
            struct Run<$a $(, $generic: $bound)*> {
                $($argument: $type),*
            }
            impl<$a $(, $generic: $bound)*> $crate::lanes::Kernel for Run<$a $(, $generic)*> {
                type Output = $crate::lanes::kernel!(@output $($output)?);
                #[inline(always)]
                fn run<$lanes: $lanes_bound>(self) -> Self::Output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            $set.run(Run::<$($generic),*> { $($argument),* })
        }
    };
    (@output) => { () };
    (@output $output:ty) => { $output };
}
pub(crate) use kernel;

/// Numbers in one or more registers. Their count is a multiple of eight.
pub trait Lanes: Scalar<Parameter = f32> {
    /// The number of octets.
    const OCTETS: usize;
    /// Lanes of eight numbers for short lists.
    type Narrow: Lanes;
    /// Lanes for long lists: two registers if one register holds these lanes, otherwise `Self`.
    type Pair: Lanes;

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

/// Lanes of one register, whose sums are registers too.
pub trait OneRegister: Lanes + Scalar<Parameter = f32, Sum = Self> {}
impl<L: Lanes + Scalar<Parameter = f32, Sum = L>> OneRegister for L {}

/// Loads lanes from the same octet of each of [`MAX_OCTETS`] items. This is a macro because the compiler does not
/// inline closures in kernels.
macro_rules! load {
    ($items:expr, $item:ident => $octet:expr) => {{
        let $item = &$items[0];
        let mut octets = [&$octet; $crate::lanes::MAX_OCTETS];
        for (octet, $item) in octets.iter_mut().zip(&$items) {
            *octet = &$octet;
        }
        L::load(octets)
    }};
}
pub(crate) use load;

/// Loads half and difference vectors.
#[inline(always)]
pub fn load_directions<L: Lanes>(octets: [&OctetDirections; MAX_OCTETS]) -> HalfDifference<L> {
    HalfDifference {
        hx: load!(octets, at => at.hx),
        hz: load!(octets, at => at.hz),
        dx: load!(octets, at => at.dx),
        dy: load!(octets, at => at.dy),
        dz: load!(octets, at => at.dz),
    }
}

/// Adds the total of each sum to an entry of a gradient.
#[inline(always)]
pub(crate) fn add_totals<L: Lanes>(sums: &[L::Sum], gradient: &mut [f32]) {
    let mut totals = vec![0.0; gradient.len()];
    L::totals(sums, &mut totals);
    for (entry, total) in gradient.iter_mut().zip(totals) {
        *entry += total;
    }
}
