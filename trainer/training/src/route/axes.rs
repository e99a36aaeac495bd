//! Axis values of a machine with two arms.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_kernels::dual::RealScalar;
use glimpse_materials::basis::angles_to_f64;
use serde::{Deserialize, Serialize};

/// One value for each axis of a machine with two arms: a position in degrees, or a speed in degrees per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axes<S = f64> {
    /// The light's polar angle, from the normal.
    pub theta_i: S,
    /// The light's azimuth about the normal.
    pub phi_i: S,
    /// The sensor's polar angle, from the normal.
    pub theta_o: S,
    /// The sensor's azimuth about the normal.
    pub phi_o: S,
}

impl Axes {
    /// The names of the axes, in the order of [`to_array`](Self::to_array).
    pub const NAMES: [&'static str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

    /// Creates axis values in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn from_array([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Self {
        Self {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        }
    }

    /// Creates speeds from one number for all axes, or from four; None for another count.
    #[must_use]
    pub fn from_speeds(speeds: &[f64]) -> Option<Self> {
        match *speeds {
            [all] => Some(Self::from_array([all; 4])),
            _ => Some(Self::from_array(speeds.try_into().ok()?)),
        }
    }

    /// Returns the values in the order theta_i, phi_i, theta_o, phi_o.
    #[must_use]
    pub fn to_array(&self) -> [f64; 4] {
        [self.theta_i, self.phi_i, self.theta_o, self.phi_o]
    }
}

impl<S: RealScalar> Axes<S> {
    /// Returns the directions of the arms at angles in radians, in degrees: polar angles of 0 to 90, azimuths of -180
    /// to 180. Along the normal, all derivatives are 0.
    pub(crate) fn from_angles(angles: Angles<S>) -> Self {
        /// The square of the sine of the polar angle below which a direction counts as the normal.
        const POLE: f64 = 1e-8;
        let directions = HalfDifference::from_angles(angles).directions();
        let spherical = |[x, y, z]: [S; 3]| {
            let square = x * x + y * y;
            [square.sqrt().atan2(z), y.atan2(x)].map(|angle| {
                let angle = match square.value() < POLE {
                    true => S::constant(angle.value()),
                    false => angle,
                };
                angle * S::constant(1_f64.to_degrees())
            })
        };
        let [theta_i, phi_i] = spherical(directions.incoming);
        let [theta_o, phi_o] = spherical(directions.outgoing);
        Self {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        }
    }
}

/// Returns the directions of the arms at a sample of a pattern, in degrees. They are those of
/// [`Recipe::directions`](glimpse_core::recipe::Recipe::directions), in double precision.
#[must_use]
pub fn axes_from_angles(angles: Angles<f32>) -> Axes {
    Axes::from_angles(angles_to_f64(&angles))
}

/// Wraps an angle into the range \[-180, 180\] degrees. An angle within that range is unchanged.
pub(super) fn wrapped<S: RealScalar>(degrees: S) -> S {
    let value = degrees.value();
    match (-180.0..=180.0).contains(&value) {
        true => degrees,
        false => degrees - S::constant(360.0 * (value / 360.0).round()),
    }
}
