//! Conversion between Rusinkiewicz angles, polar angles and vectors.

use std::f64::consts::TAU;

use glimpse_core::geometry::{Angles, Directions, HalfDifference};

/// The smallest cosine of a direction above the horizon. Within 6e-8 degrees of the horizon, rounding decides the side.
const MIN_COSINE: f64 = 1e-9;
/// The theta_h below which the half vector is the normal, radians: the error of directions in single precision, or in degrees
/// with 5 decimals.
const POLE: f64 = 1e-6;

/// Returns the direction of length 1 at a polar angle and an azimuth, in radians.
pub(super) fn vector(theta: f64, phi: f64) -> [f64; 3] {
    let (sin, cos) = theta.sin_cos();
    [sin * phi.cos(), sin * phi.sin(), cos]
}

/// Returns the polar angle and the azimuth of a direction, in radians.
pub(super) fn polar_angles([x, y, z]: [f64; 3]) -> [f64; 2] {
    [x.hypot(y).atan2(z), y.atan2(x)]
}

/// Returns theta_i, phi_i, theta_o, phi_o of Rusinkiewicz angles, all in radians.
#[must_use]
pub fn polar(angles: Angles<f64>) -> [f64; 4] {
    let pair = HalfDifference::from_angles(angles).directions();
    let [[theta_i, phi_i], [theta_o, phi_o]] = [pair.incoming, pair.outgoing].map(polar_angles);
    [theta_i, phi_i, theta_o, phi_o]
}

/// Returns the Rusinkiewicz angles, in radians, of two directions of length 1 that point away from the surface.
/// The z axis is the surface normal, and phi_d is in \[0, 2 pi). None if one direction is not above the horizon.
#[must_use]
pub fn angles_from_vectors(incoming: [f64; 3], outgoing: [f64; 3]) -> Option<Angles<f32>> {
    above_horizon(rusinkiewicz(incoming, outgoing))
}

/// Returns the Rusinkiewicz angles, in radians, of two directions of length 1.
#[must_use]
pub fn rusinkiewicz(incoming: [f64; 3], outgoing: [f64; 3]) -> Angles<f64> {
    let sum: [f64; 3] = std::array::from_fn(|i| incoming[i] + outgoing[i]);
    let difference: [f64; 3] = std::array::from_fn(|i| incoming[i] - outgoing[i]);
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
    let theta_h = sum[0].hypot(sum[1]).atan2(sum[2]);
    let [x, y, z] = incoming;
    // At the pole, phi_d is 0, as on the device: the azimuth of the half vector is that of the light.
    let phi_h = if theta_h < POLE {
        y.atan2(x)
    } else {
        sum[1].atan2(sum[0])
    };
    // Rotate the incoming direction so that the half vector is the z axis.
    let (sin, cos) = phi_h.sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    Angles {
        theta_h,
        theta_d: length(difference).atan2(length(sum)),
        phi_d: across.atan2(along * theta_h.cos() - z * theta_h.sin()),
    }
}

/// Converts to single precision with phi_d in \[0, 2 pi); None if one direction is not above the horizon.
pub(super) fn above_horizon(angles: Angles<f64>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_angles(angles);
    let is_above = at.cos_theta_i() > MIN_COSINE && at.cos_theta_o() > MIN_COSINE;
    let phi_d = angles.phi_d.rem_euclid(TAU) as f32;
    // Of two equal directions, rounding may turn one angle to -0 or to the whole turn.
    let is_whole_turn = phi_d >= TAU as f32;
    is_above.then_some(Angles {
        theta_h: angles.theta_h as f32 + 0.0,
        theta_d: angles.theta_d as f32 + 0.0,
        phi_d: if is_whole_turn { 0.0 } else { phi_d + 0.0 },
    })
}

/// Converts Rusinkiewicz angles, in radians, to vectors.
pub(super) fn to_directions(angles: Angles<f64>) -> Directions<f32> {
    let pair = HalfDifference::from_angles(angles).directions();
    Directions {
        incoming: pair.incoming.map(|x| x as f32),
        outgoing: pair.outgoing.map(|x| x as f32),
    }
}
