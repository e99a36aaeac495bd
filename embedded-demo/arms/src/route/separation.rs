//! The minimum angle between lamp and sensor while both arms move.

use core::f32::consts::{PI, TAU};

use super::AxisAngles;

/// Range of a polar angle, as the sines and cosines of its ends.
struct Arc([(f32, f32); 2]);

impl Arc {
    /// Returns the maximum of `x cos(angle) + y sin(angle)` on an arc of less than half a turn.
    fn peak(&self, x: f32, y: f32) -> f32 {
        let Self([low, high]) = *self;
        let value = |(sin, cos): (f32, f32)| x * cos + y * sin;
        let slope = |(sin, cos): (f32, f32)| y * cos - x * sin;
        if slope(low) > 0.0 && slope(high) < 0.0 {
            libm::sqrtf(x * x + y * y)
        } else {
            value(low).max(value(high))
        }
    }
}

/// Returns true if an angle plus full turns is between `low` and `high`.
fn contains(low: f32, high: f32, angle: f32) -> bool {
    libm::ceilf((low - angle) / TAU) <= libm::floorf((high - angle) / TAU)
}

/// Returns the minimum angle between lamp and sensor, radians, while each axis moves from its angle in `from` to that
/// in `to`. The speeds are arbitrary, so the axes may be at any angles in between. Returns 0 if a polar angle moves by
/// half a turn or more, or is not finite.
///
/// The cosine of the angle is cos θi cos θo + c sin θi sin θo, where c is the cosine of the azimuth difference. It is
/// linear in c. For |c| < 1 its only maximum inside the box of polar angles is at the normal; for |c| = 1 the maximum
/// extends to the edges of the box. Along an edge it is a sine.
#[must_use]
#[inline(never)] // saves flash: one copy for several calls
pub fn separation_between(from: AxisAngles, to: AxisAngles) -> f32 {
    let mut pairs = from.into_iter().zip(to);
    let [theta_i, phi_i, theta_o, phi_o] = [(); 4].map(|()| {
        let (a, b) = pairs.next().unwrap_or_default();
        (a.min(b), a.max(b))
    });
    // Azimuth difference.
    let (low, high) = (phi_o.0 - phi_i.1, phi_o.1 - phi_i.0);
    let is_finite = from.iter().chain(&to).all(|angle| angle.is_finite());
    let is_half_a_turn = |(low, high): (f32, f32)| high - low >= PI;
    let has_normal = |(low, high): (f32, f32)| low <= 0.0 && high >= 0.0;
    if !is_finite
        || is_half_a_turn(theta_i)
        || is_half_a_turn(theta_o)
        || has_normal(theta_i) && has_normal(theta_o)
    {
        return 0.0;
    }
    let cosines = [
        if contains(low, high, PI) {
            -1.0
        } else {
            libm::cosf(low).min(libm::cosf(high))
        },
        if contains(low, high, 0.0) {
            1.0
        } else {
            libm::cosf(low).max(libm::cosf(high))
        },
    ];
    let arc = |(low, high)| Arc([libm::sincosf(low), libm::sincosf(high)]);
    let (theta_i, theta_o) = (arc(theta_i), arc(theta_o));
    let mut max_cosine = -1.0_f32;
    for cosine in cosines {
        for (fixed, moving) in [(&theta_i, &theta_o), (&theta_o, &theta_i)] {
            for (sin, cos) in fixed.0 {
                max_cosine = max_cosine.max(moving.peak(cos, cosine * sin));
            }
        }
    }
    libm::acosf(max_cosine.min(1.0))
}
