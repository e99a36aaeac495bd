//! Which lanes a kernel runs on, decided at run time.

use super::portable::PortableLanes;
use super::register::Kernel;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};

/// Runs a kernel on the best lanes that this machine has.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    InstructionSet::of_this_machine().run(kernel)
}

/// What [`dispatch`] can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512: 16 numbers in a register.
    Avx512,
    /// AVX2 and FMA: eight.
    Avx2,
    /// Whatever the compiler takes for granted: NEON on 64-bit Arm, SSE2 on x86-64.
    Portable,
}

impl InstructionSet {
    /// What [`dispatch`] uses here.
    #[must_use]
    pub fn of_this_machine() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if avx512::is_available() {
                return Self::Avx512;
            }
            if avx2::is_available() {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Runs a kernel on these lanes, or on lesser ones if this machine does not have them.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Avx512 if avx512::is_available() => return avx512::run(kernel),
            Self::Avx512 | Self::Avx2 if avx2::is_available() => return avx2::run(kernel),
            _ => {}
        }
        kernel.run::<PortableLanes>()
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "AVX-512",
            Self::Avx2 => "AVX2 + FMA",
            Self::Portable if cfg!(target_arch = "aarch64") => "NEON",
            Self::Portable => "portable",
        }
    }
}
