//! Run-time selection of the lanes that a kernel runs on.

use super::portable;
use super::register::Kernel;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512: 16 numbers in a register.
    Avx512,
    /// AVX2 and FMA: 8 numbers in a register.
    Avx2,
    /// The instructions of the compilation target: by default NEON on 64-bit Arm, SSE2 on x86-64.
    Portable,
}

impl InstructionSet {
    /// Returns the widest instruction set of this machine.
    #[must_use]
    pub fn detect() -> Self {
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

    /// Runs a kernel on these lanes, or on narrower ones if this machine lacks them.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Avx512 if avx512::is_available() => return avx512::run(kernel),
            Self::Avx512 | Self::Avx2 if avx2::is_available() => return avx2::run(kernel),
            _ => {}
        }
        portable::run(kernel)
    }

    /// Returns the display name.
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
