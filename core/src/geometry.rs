//! Directions, spherical and Rusinkiewicz angles, half and difference vectors.
//!
//! The angles (theta_h, theta_d, phi_d) of the half vector and the difference vector, with phi_h = 0 (Rusinkiewicz
//! 1998), describe a pair of directions of an isotropic BRDF: incoming w_i and outgoing w_o, of unit length, with z
//! along the normal.
//!
//! [`Arms`] are the spherical angles of both directions, as the arms of a scanner have them. An isotropic BRDF
//! does not change if both directions are turned about the normal.

mod angles;
mod arms;
mod directions;
mod half_difference;

pub use angles::Angles;
pub use arms::Arms;
pub(crate) use directions::Arm;
pub use directions::Directions;
pub(crate) use directions::UNIT_TOLERANCE;
internal! { half_difference::HalfDifference }
