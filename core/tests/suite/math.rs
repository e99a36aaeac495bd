//! Measured errors of elementary functions, compared with the table in `src/numeric/math.rs`.

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::{PI, TAU};

use glimpse_core::numeric::math;

/// The bounds of the table: exp (relative), ln (relative, absolute with micromath), sqrt (relative), sine and cosine
/// (absolute), atan2 (absolute).
#[cfg(not(feature = "micromath"))]
const BOUNDS: [f64; 5] = [8e-8, 9e-8, 6e-8, 9e-8, 3e-7];
#[cfg(feature = "micromath")]
const BOUNDS: [f64; 5] = [2.4e-3, 7e-5, 1.6e-6, 9e-8, 3e-7];

/// The largest `error` at many numbers, evenly spaced from `low` to `high`.
fn max_error(low: f64, high: f64, error: impl Fn(f64) -> f64) -> f64 {
    let last = 2_000_000;
    (0..=last)
        .map(|i| error(low + (high - low) * f64::from(i) / f64::from(last)))
        .fold(0.0, f64::max)
}

fn relative(actual: f32, expected: f64) -> f64 {
    if f64::from(actual) == expected {
        return 0.0;
    }
    ((f64::from(actual) - expected) / expected).abs()
}

fn absolute(actual: f32, expected: f64) -> f64 {
    (f64::from(actual) - expected).abs()
}

/// Checks that an error is within its bound, and at most a fifth below it, so that the table is accurate.
fn assert_bound(name: &str, actual: f64, bound: f64) {
    println!("{name}: {actual:.2e}, bound {bound:.1e}");
    assert!(actual <= bound, "{name}: {actual:e} is above {bound:e}");
    let is_valid = actual >= 0.8 * bound;
    assert!(is_valid, "{name}: {actual:e} is well below {bound:e}");
}

#[test]
fn errors_are_within_bounds() {
    let [exp, ln, sqrt, sin_cos, atan2] = BOUNDS;
    let error = max_error(-87.0, 88.0, |x| {
        let x = x as f32;
        relative(math::exp(x), f64::from(x).exp())
    });
    assert_bound("exp", error, exp);
    let error_at = |x: f64| {
        let x = x as f32;
        by_math!(relative, absolute)(math::ln(x), f64::from(x).ln())
    };
    // All orders of magnitude, and more densely near 1, where the logarithm is 0.
    let everywhere = max_error(-87.0, 88.0, |logarithm| error_at(logarithm.exp()));
    assert_bound("ln", everywhere.max(max_error(0.25, 4.0, error_at)), ln);
    let error = max_error(-87.0, 88.0, |logarithm| {
        let x = logarithm.exp() as f32;
        relative(math::sqrt(x), f64::from(x).sqrt())
    });
    assert_bound("sqrt", error, sqrt);
    let error = max_error(-TAU, TAU, |x| {
        let x = x as f32;
        let (sin, cos) = math::sin_cos(x);
        let exact = f64::from(x).sin_cos();
        absolute(sin, exact.0).max(absolute(cos, exact.1))
    });
    assert_bound("sine and cosine", error, sin_cos);
    let error = max_error(-PI, PI, |angle| {
        let (y, x) = ((0.7 * angle.sin()) as f32, (0.7 * angle.cos()) as f32);
        absolute(math::atan2(y, x), f64::from(y).atan2(f64::from(x)))
    });
    assert_bound("atan2", error, atan2);
}

#[test]
fn roots_and_azimuths_of_0() {
    assert_eq!(math::sqrt(0.0), 0.0);
    assert_eq!(math::atan2(0.0, 0.0), 0.0);
    // An arm at the pole has azimuth 0.
    assert_eq!(math::atan2(0.0, -0.0), 0.0);
    assert_eq!(math::atan2(1.0, 0.0), FRAC_PI_2);
    for (y, x) in [(f32::NAN, 1.0), (1.0, f32::NAN), (f32::NAN, 0.0)] {
        assert!(math::atan2(y, x).is_nan());
    }
}

/// With micromath, exp(89) was NaN, or panicked with debug assertions.
#[test]
fn handles_extreme_arguments() {
    for x in [88.75, 89.0, 89.5, 1e3, 1e30, f32::MAX, f32::INFINITY] {
        assert_eq!(math::exp(x), f32::INFINITY, "{x}");
        assert!(math::exp(-x) < 1e-37, "{x}");
    }
    assert!(math::exp(f32::NAN).is_nan());
    assert!(math::exp(88.0).is_finite());
    // No number causes a panic: all exponents, subnormal numbers, infinities and NaNs.
    for high_bits in 0..=u16::MAX {
        let x = f32::from_bits((u32::from(high_bits) << 16) | 0x1234);
        let _ = (math::exp(x), math::sqrt(x), math::sin_cos(x));
        if x > 0.0 || x.is_nan() {
            let _ = math::ln(x);
        }
    }
}
