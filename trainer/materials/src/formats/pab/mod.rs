//! PAB-Opto "Mountain" text: the output of PAB-Opto's goniophotometers, and the input of Radiance's `pabopto2bsdf`.
//!
//! There are one or more files per incoming direction. Their header lines start with `#`. One line follows per outgoing direction:
//! theta_o and phi_o in degrees, and the BRDF in sr^-1 (not times the cosine) as CIE XYZ. Both directions point away
//! from the surface; a mirror reflects phi to phi + 180 degrees.

mod file;
mod read;
mod write;

pub(crate) use file::files_of;
pub(super) use file::{Incidence, has_signature};
pub use read::PabSet;
pub(super) use write::{ENDINGS, THETA_I, outgoing_angles, to_pab};

use glimpse_core::geometry::{Directions, HalfDifference};

/// The difference in degrees below which two angles count as equal.
const ANGLE_TOLERANCE: f64 = 0.01;

/// Returns the pair of a light at phi_i = 0 and a sensor, both above the horizon, with angles in degrees.
pub(super) fn pair(theta_i: f64, theta_o: f64, phi_o: f64) -> HalfDifference<f32> {
    let [incoming, outgoing] = [direction(theta_i, 0.0), direction(theta_o, phi_o)]
        .map(|direction| direction.map(|value| value as f32));
    // Directions above the horizon are never opposite.
    HalfDifference::from_directions(&Directions { incoming, outgoing }).unwrap_or_default()
}

/// Returns the unit vector with polar angle `theta` and azimuth `phi`, in degrees.
fn direction(theta: f64, phi: f64) -> [f64; 3] {
    let (sin, cos) = theta.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi.to_radians().sin_cos();
    [sin * cos_phi, sin * sin_phi, cos]
}
