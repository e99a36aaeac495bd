//! The least angle between lamp and sensor while both arms move.

use core::f32::consts::{PI, TAU};

use super::AxisAngles;

/// A range of angles, radians.
#[derive(Clone, Copy)]
struct Span {
    low: f32,
    high: f32,
}

impl Span {
    fn between(a: f32, b: f32) -> Self {
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }

    /// Returns true if it contains `angle` plus any number of turns.
    fn contains(self, angle: f32) -> bool {
        libm::ceilf((self.low - angle) / TAU) <= libm::floorf((self.high - angle) / TAU)
    }

    /// The least and the largest cosine.
    fn cosines(self) -> [f32; 2] {
        let [low, high] = [self.low, self.high].map(libm::cosf);
        [
            if self.contains(PI) {
                -1.0
            } else {
                low.min(high)
            },
            if self.contains(0.0) {
                1.0
            } else {
                low.max(high)
            },
        ]
    }

    /// The largest `x cos(angle) + y sin(angle)`.
    fn peak(self, x: f32, y: f32) -> f32 {
        if self.contains(libm::atan2f(y, x)) {
            return libm::sqrtf(x * x + y * y);
        }
        let at = |angle| x * libm::cosf(angle) + y * libm::sinf(angle);
        at(self.low).max(at(self.high))
    }
}

/// The least angle between lamp and sensor, radians, while each axis moves from its angle in `from`
/// to that in `to`, whatever the speeds: the axes may be at any angle in between independently of
/// each other.
///
/// Its cosine is cos θi cos θo + c sin θi sin θo, where c is the cosine of the azimuths' difference.
/// It is linear in c. For |c| < 1 its only maximum inside the box of polar angles is at the normal;
/// for |c| = 1 the maximum extends to the box's edges. Along an edge it is a sine.
#[must_use]
pub fn separation_between(from: AxisAngles, to: AxisAngles) -> f32 {
    if !from.iter().chain(&to).all(|angle| angle.is_finite()) {
        return 0.0;
    }
    let mut pairs = from.into_iter().zip(to);
    let spans = [(); 4].map(|()| {
        pairs.next().map_or(
            Span {
                low: 0.0,
                high: 0.0,
            },
            |(a, b)| Span::between(a, b),
        )
    });
    let [theta_i, phi_i, theta_o, phi_o] = spans;
    if theta_i.contains(0.0) && theta_o.contains(0.0) {
        return 0.0;
    }
    let apart = Span {
        low: phi_o.low - phi_i.high,
        high: phi_o.high - phi_i.low,
    };
    let mut largest = -1.0_f32;
    for cosine in apart.cosines() {
        for (edge, other) in [
            (theta_i.low, theta_o),
            (theta_i.high, theta_o),
            (theta_o.low, theta_i),
            (theta_o.high, theta_i),
        ] {
            let (sin, cos) = libm::sincosf(edge);
            largest = largest.max(other.peak(cos, cosine * sin));
        }
    }
    libm::acosf(largest.min(1.0))
}
