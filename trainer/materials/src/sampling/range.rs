//! What angles of a sample can be.

use std::f32::consts::{FRAC_PI_2, PI};

/// Upper ends of theta_h, theta_d and phi_d; the lower ends are 0.
pub const RANGE: [f32; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
