//! Sine and cosine in f32 only.
//!
//! libm's versions use f64, which a microcontroller computes in software, with 5 kB of flash.

use core::f32::consts::FRAC_2_PI;

/// pi / 2 in three parts; the products of the first two with small integers are exact.
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Sine and cosine of `x` in radians, |x| up to a few thousand.
#[inline(never)]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // x = quarters pi / 2 + r, |r| <= pi / 4.
    let quarters = (x * FRAC_2_PI + 0.5_f32.copysign(x)) as i32;
    let count = quarters as f32;
    let [high, middle, low] = QUARTER;
    let r = ((x - count * high) - count * middle) - count * low;

    // The minimax polynomials on that interval.
    let square = r * r;
    let sin = -1.951_529_6e-4 * square + 8.332_161e-3;
    let sin = (sin * square - 0.166_666_55) * square * r + r;
    let cos = 2.443_315_7e-5 * square - 1.388_731_6e-3;
    let cos = (cos * square + 4.166_664_6e-2) * square * square - 0.5 * square + 1.0;

    match quarters & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}
