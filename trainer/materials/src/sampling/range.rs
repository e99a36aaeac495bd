//! Ranges of a sample's angles.

use std::f32::consts::{FRAC_PI_2, PI};

/// Upper limits of theta_h, theta_d and phi_d, radians. The lower limits are 0.
pub const RANGE: [f32; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
