//! SIMD lanes: eight samples and more computed side by side, on what instructions the machine has.
//!
//! A [`Kernel`] is written once over [`Lanes`]; [`dispatch`] picks the lanes at run time, so that
//! a plain build uses AVX-512, or AVX2 and FMA, where they exist. (NEON is part of every 64-bit
//! Arm, so the portable lanes are compiled to it there.) All of a kernel must be inlined into
//! `dispatch` for that: mark its functions `#[inline(always)]` and write loops rather than
//! `array::map` or `from_fn`, whose closures the compiler leaves out of line.

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
mod total;

pub use instruction_set::{InstructionSet, dispatch};
pub use octet::{MOST_OCTETS, Octet, OctetAt, Octets, WIDTH};
pub use portable::PortableLanes;
pub use register::{Kernel, Lanes, Narrowest, load_at, narrows, narrows_twice};
pub use register_pair::RegisterPair;
pub use total::Total;
