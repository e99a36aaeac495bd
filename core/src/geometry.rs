//! Directions, spherical and Rusinkiewicz angles, half and difference vectors.
//!
//! A pair of directions (incoming w_i, outgoing w_o; unit, z along the normal)
//! of an isotropic BRDF is described by the angles (theta_h, theta_d, phi_d)
//! of its half vector and its difference vector, with phi_h = 0 (Rusinkiewicz
//! 1998).
//!
//! A scanner's arms stand at [`ArmAngles`], the spherical angles of both directions. Isotropic means
//! that [turning](Directions::turned) both about the normal changes nothing.

mod angles;
mod directions;
mod error;
mod half_difference;
mod spherical;

pub use angles::Angles;
pub use directions::Directions;
pub use error::{Arm, DirectionsError, UNIT_TOLERANCE};
internal! { half_difference::HalfDifference }
pub use spherical::{ArmAngles, Spherical};
