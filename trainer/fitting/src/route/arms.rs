//! Directions of a machine's arms, in degrees.

use glimpse_core::geometry::{Angles, Arms, HalfDifference};
use glimpse_kernels::dual::RealScalar;

/// Returns the directions of the arms at angles in radians, in degrees: polar angles of 0 to 90, azimuths of -180 to
/// 180. Along the normal, all derivatives are 0.
pub fn arms_at<S: RealScalar>(angles: Angles<S>) -> Arms<S> {
    /// The square of the sine of the polar angle below which a direction counts as the normal.
    const POLE: f64 = 1e-8;
    let directions = HalfDifference::from_angles(angles).directions();
    let spherical = |[x, y, z]: [S; 3]| {
        let square = x * x + y * y;
        [square.sqrt().atan2(z), y.atan2(x)].map(|angle| {
            let angle = if square.value() < POLE {
                S::constant(angle.value())
            } else {
                angle
            };
            angle * S::constant(1_f64.to_degrees())
        })
    };
    let [theta_i, phi_i] = spherical(directions.incoming);
    let [theta_o, phi_o] = spherical(directions.outgoing);
    Arms::from_array([theta_i, phi_i, theta_o, phi_o])
}

/// Returns the directions of the arms at a sample of a pattern, in degrees. They are those of
/// [`Recipe::directions`](glimpse_core::recipe::Recipe::directions), in double precision.
#[must_use]
pub fn arms_in_degrees(angles: Angles<f32>) -> Arms<f64> {
    arms_at(angles.map(f64::from))
}

/// Returns [`arms_in_degrees`] after a turn about the normal that brings the light to azimuth 0, and that of the sensor to 0
/// to 360 degrees. An isotropic BRDF stays the same.
#[must_use]
pub fn relative_arms(angles: Angles<f32>) -> Arms<f64> {
    let arms = arms_in_degrees(angles);
    Arms {
        phi_i: 0.0,
        phi_o: (arms.phi_o - arms.phi_i).rem_euclid(360.0),
        ..arms
    }
}

/// Returns the same directions in one plane with the normal, for arms that swing through the normal: theta_o is negative on the
/// light's side, and the azimuths are 0 and 180 degrees.
pub(super) fn swung<S: RealScalar>(arms: &Arms<S>) -> Arms<S> {
    let is_on_light_side = wrapped(arms.phi_o - arms.phi_i).value().abs() < 90.0;
    Arms {
        theta_i: arms.theta_i,
        phi_i: S::constant(0.0),
        theta_o: if is_on_light_side {
            -arms.theta_o
        } else {
            arms.theta_o
        },
        phi_o: S::constant(180.0),
    }
}

/// Returns the axes of [`relative_arms`]. In one plane, theta_o is negative on the light's side, and azimuths are absent.
#[must_use]
pub fn axes_of(angles: Angles<f32>, in_plane: bool) -> Arms<Option<f64>> {
    let arms = relative_arms(angles);
    if !in_plane {
        return arms.map(Some);
    }
    let Arms {
        theta_i, theta_o, ..
    } = swung(&arms).map(Some);
    Arms {
        theta_i,
        theta_o,
        ..Arms::default()
    }
}

/// Creates speeds from one number for all axes, from two of a machine without azimuths, or from four; None for another count.
#[must_use]
pub fn axis_speeds(speeds: &[f64]) -> Option<Arms<f64>> {
    match *speeds {
        [all] => Some(Arms::from_array([all; 4])),
        [theta_i, theta_o] => Some(Arms::from_array([theta_i, 0.0, theta_o, 0.0])),
        _ => Some(Arms::from_array(speeds.try_into().ok()?)),
    }
}

/// Wraps an angle into the range \[-180, 180\] degrees. An angle within that range is unchanged.
pub(crate) fn wrapped<S: RealScalar>(degrees: S) -> S {
    let value = degrees.value();
    if (-180.0..=180.0).contains(&value) {
        degrees
    } else {
        degrees - S::constant(360.0 * (value / 360.0).round())
    }
}
