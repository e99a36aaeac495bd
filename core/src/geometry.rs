//! Rusinkiewicz angles, half and difference vectors, and directions.
//!
//! A pair of directions (incoming w_i, outgoing w_o; unit, z along the normal)
//! of an isotropic BRDF is described by the angles (theta_h, theta_d, phi_d)
//! of its half vector and its difference vector, with phi_h = 0 (Rusinkiewicz
//! 1998). Models read the Cartesian form, [`HalfDifference`].

mod angles;
mod directions;
mod half_difference;

pub use angles::Angles;
pub use directions::Directions;
pub use half_difference::HalfDifference;
