//! Arithmetic for scanners: limits, counts, repeated readings, the next move, a tile.

mod calibration;
mod limits;
mod nearest;
mod repeated;
mod tile;

use glimpse_core::geometry::{Arms, Directions};

/// Arms at theta_i, phi_i, theta_o, phi_o in degrees.
fn arms(degrees: [f32; 4]) -> Arms {
    Arms::from_array(degrees.map(f32::to_radians))
}

/// The directions of arms at these angles in degrees.
fn at(degrees: [f32; 4]) -> Directions<f32> {
    arms(degrees).directions()
}

/// Returns true if `a` equals `b` within several rounding errors.
fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-5 * (1.0 + b.abs())
}
