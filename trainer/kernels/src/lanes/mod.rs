//! SIMD lanes: eight or more samples per operation.
//!
//! A [`Kernel`] is written once, generic over [`Lanes`]. [`InstructionSet`] picks the lanes at run time, so a default
//! build uses AVX-512, or AVX2 and FMA, if the processor has them. On 64-bit Arm the portable lanes compile to NEON,
//! which is always available there.
//!
//! The whole kernel must be inlined into [`InstructionSet::run`]. Mark its functions `#[inline(always)]`, write loops
//! instead of `array::map` or `from_fn`, and iterate over arrays by reference: the compiler does not inline closures and
//! iterators of arrays by value.

#[cfg(target_arch = "x86_64")]
mod arithmetic;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod elementary;
mod instruction_set;
mod octet;
mod portable;
mod register;
mod register_pair;

pub use instruction_set::InstructionSet;
pub(crate) use octet::coordinates_mut;
pub use octet::{MAX_OCTETS, Octet, OctetDirections, Octets, WIDTH};
pub use portable::PortableLanes;
pub use register::{Kernel, Lanes, OneRegister, load_directions};
pub(crate) use register::{add_totals, kernel, load};
pub use register_pair::RegisterPair;
