//! The angle of a point in the plane, in f32 only.

use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// tan(pi / 8), up to which the polynomial is accurate.
const MAX_RATIO: f32 = 0.414_213_57;

/// The angle between the x axis and (`x`, `y`) in radians, in \[-pi, pi\]; 0 for (0, 0).
#[inline(never)]
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (height, width) = (y.abs(), x.abs());
    let steep = height > width;
    let (small, large) = if steep {
        (width, height)
    } else {
        (height, width)
    };
    if small == 0.0 && large == 0.0 {
        return 0.0;
    }
    // atan(small / large) = pi / 4 + atan((small - large) / (small + large)).
    let (offset, r) = if small > MAX_RATIO * large {
        (FRAC_PI_4, (small - large) / (small + large))
    } else {
        (0.0, small / large)
    };

    // The minimax polynomial for |r| <= tan(pi / 8), with an error of 5e-9 before rounding.
    let square = r * r;
    let atan = 7.902_598_4e-2 * square - 0.138_244_54;
    let atan = (atan * square + 0.199_718_8) * square - 0.333_327_57;
    let octant = offset + (atan * square * r + r);

    let quadrant = if steep { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    half.copysign(y)
}
