//! Arithmetic for scanners: limits, counts, repeated readings, the next move, a tile.

mod calibration;
mod limits;
mod nearest;
mod repeated;
mod tile;

use glimpse_core::geometry::{ArmAngles, Directions, Spherical};

/// Arms at theta_i, phi_i, theta_o, phi_o in degrees.
fn arms([theta_i, phi_i, theta_o, phi_o]: [f32; 4]) -> ArmAngles {
    let arm = |theta: f32, phi: f32| Spherical {
        theta: theta.to_radians(),
        phi: phi.to_radians(),
    };
    ArmAngles {
        incoming: arm(theta_i, phi_i),
        outgoing: arm(theta_o, phi_o),
    }
}

/// The directions of arms at these angles in degrees.
fn at(degrees: [f32; 4]) -> Directions<f32> {
    arms(degrees).directions()
}

/// Returns true if `a` equals `b` within several rounding errors.
fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-5 * (1.0 + b.abs())
}
