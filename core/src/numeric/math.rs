//! Elementary functions in `f32`, by libm (default) or micromath (feature).
//!
//! Largest errors, which `tests/suite/math.rs` measures and asserts:
//!
//! | function | argument | libm | micromath |
//! |---|---|---|---|
//! | [`exp`] | -87 to 88 | 8e-8 relative | 2.4e-3 relative |
//! | [`ln`] | e^-87 to e^88 | 9e-8 relative | 7e-5 absolute |
//! | [`sqrt`] | e^-87 to e^88 | exact (6e-8 relative) | 1.6e-6 relative: estimate and two Newton steps |
//! | [`sin_cos`] | -2 pi to 2 pi | 9e-8 absolute | the same |
//! | [`atan2`] | all around | 3e-7 absolute | the same |
//!
//! [`sin_cos`] and [`atan2`] are this crate's own, in f32 only (libm's sine uses f64). micromath's versions have errors
//! of 1.1e-3 and 2.8e-3. With them, one in six directions would not be a unit vector within 0.001, as the geometry
//! requires, and arms would miss their positions by more than their resolution. micromath's `sqrt` has an error of 5 %,
//! and its `ln` an error of 0.12 below 1, due to an estimated reciprocal. This module corrects both.

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("glimpse-core needs the feature `libm` (default) or `micromath`");

mod atan2;
mod sin_cos;

pub use atan2::atan2;
pub use sin_cos::sin_cos;

#[cfg(feature = "micromath")]
mod implementation {
    use micromath::F32Ext;

    /// Just below the logarithm of the largest float. From there to 89.4, and for NaN, micromath's `exp` returns NaN,
    /// or panics with debug assertions.
    const MAX_LOGARITHM: f32 = 88.72;

    #[inline]
    pub(super) fn exp(x: f32) -> f32 {
        if x <= MAX_LOGARITHM {
            F32Ext::exp(x)
        } else {
            x + f32::INFINITY // NaN stays NaN
        }
    }
    #[inline]
    pub(super) fn ln(x: f32) -> f32 {
        if x < 1.0 {
            -F32Ext::ln(1.0 / x)
        } else {
            F32Ext::ln(x)
        }
    }
    #[inline]
    pub(super) fn sqrt(x: f32) -> f32 {
        if x <= 0.0 {
            return 0.0;
        }
        let mut root = F32Ext::sqrt(x);
        for _ in 0..2 {
            root = 0.5 * (root + x / root);
        }
        root
    }
}

#[cfg(not(feature = "micromath"))]
mod implementation {
    pub(super) use libm::{expf as exp, logf as ln, sqrtf as sqrt};
}

/// e to the power of `x`.
#[inline(never)]
#[must_use]
pub fn exp(x: f32) -> f32 {
    implementation::exp(x)
}

/// Natural logarithm of `x` > 0.
#[inline(never)]
#[must_use]
pub fn ln(x: f32) -> f32 {
    implementation::ln(x)
}

/// Square root of `x` >= 0.
#[inline(never)]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    implementation::sqrt(x)
}
