//! Conversion of half and difference vectors to angles.

use std::f32::consts::TAU;

use glimpse_core::geometry::{Angles, HalfDifference};

/// Returns the Rusinkiewicz angles of half and difference vectors, in radians. phi_d is in \[0, 2 pi).
#[must_use]
pub fn angles_of(at: &HalfDifference<f32>) -> Angles<f32> {
    let phi_d = at.dy.atan2(at.dx);
    Angles {
        theta_h: at.hx.atan2(at.hz),
        theta_d: at.dx.hypot(at.dy).atan2(at.dz),
        phi_d: if phi_d < 0.0 { phi_d + TAU } else { phi_d },
    }
}
