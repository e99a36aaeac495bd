//! Pairs of directions.

use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorCode};
use crate::numeric::math;

/// The largest deviation of a direction's length from 1. It admits directions from tables with three decimals.
pub(crate) const UNIT_TOLERANCE: f32 = 1e-3;

/// One of the two arms of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arm {
    /// The arm with the light, at the incoming direction.
    Light,
    /// The arm with the sensor, at the outgoing direction.
    Sensor,
}

impl Arm {
    /// Returns the error of an invalid direction of this arm.
    pub(crate) const fn error(self) -> Error {
        Error::with(ErrorCode::Directions, [self as u32, 0])
    }
}

/// A pair of unit directions, pointing away from the surface; z is the normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Directions<T> {
    /// Towards the light, w_i.
    pub incoming: [T; 3],
    /// Towards the sensor, w_o.
    pub outgoing: [T; 3],
}

/// Normalizes a finite direction whose length is 1 within [`UNIT_TOLERANCE`], by one step of Newton's method; None for
/// other vectors. The result is a unit vector within 2e-6, and within rounding if the direction was one already. (A
/// square root would be less accurate with micromath.)
#[inline]
pub(super) fn normalize(direction: [f32; 3]) -> Option<[f32; 3]> {
    const SHORTEST: f32 = (1.0 - UNIT_TOLERANCE) * (1.0 - UNIT_TOLERANCE);
    const LONGEST: f32 = (1.0 + UNIT_TOLERANCE) * (1.0 + UNIT_TOLERANCE);
    let square: f32 = dot(direction, direction);
    // No range contains a NaN.
    (SHORTEST..=LONGEST)
        .contains(&square)
        .then(|| direction.map(|coordinate| coordinate * (1.5 - 0.5 * square)))
}

fn dot([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    a * x + b * y + c * z
}

fn cross([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

impl Directions<f32> {
    /// Checks that the BRDF is defined at these directions.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`] with the arm (0 light, 1 sensor) whose direction is not finite, not a unit vector
    /// within 0.001, or not above the horizon.
    pub fn check(&self) -> Result<(), Error> {
        for (arm, direction) in [(Arm::Light, self.incoming), (Arm::Sensor, self.outgoing)] {
            match normalize(direction) {
                Some([_, _, cos_theta]) if cos_theta > 0.0 => {}
                _ => return Err(arm.error()),
            }
        }
        Ok(())
    }

    /// The angle between light and sensor in radians, 0 to pi: 2 theta_d. NaN for a NaN coordinate.
    ///
    /// The error is at most 5e-7 rad, even if the directions nearly coincide. An arc cosine would have an error of the
    /// square root of that.
    #[must_use]
    pub fn separation(&self) -> f32 {
        let across = cross(self.incoming, self.outgoing);
        math::atan2(
            math::sqrt(dot(across, across)),
            dot(self.incoming, self.outgoing),
        )
    }

    /// The angle in radians, 0 to pi/2, by which light, normal and sensor deviate from one plane. The normal and the
    /// direction farther from it span a plane; this is the angle between the other direction and that plane. 0 if both
    /// directions lie along the normal; NaN for a NaN coordinate.
    #[must_use]
    pub fn out_of_plane(&self) -> f32 {
        let ([ix, iy, _], [ox, oy, _]) = (self.incoming, self.outgoing);
        let (square_i, square_o) = (ix * ix + iy * iy, ox * ox + oy * oy);
        let farther = math::sqrt(if square_i > square_o {
            square_i
        } else {
            square_o
        });
        let volume = (ix * oy - iy * ox).abs();
        if farther == 0.0 {
            return 0.0;
        }
        let sin = volume / farther;
        let square_cos = 1.0 - sin * sin;
        // Rounding may make it negative near a right angle.
        let cos = math::sqrt(if square_cos < 0.0 { 0.0 } else { square_cos });
        math::atan2(sin, cos)
    }
}
