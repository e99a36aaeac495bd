//! PAB-Opto "Mountain" text: the output of PAB-Opto's goniophotometers, and the input of Radiance's `pabopto2bsdf`.
//!
//! There are one or more files per incoming direction. Their header lines start with `#`. One line follows per outgoing direction:
//! theta_o and phi_o in degrees, and the BRDF in sr^-1 (not times the cosine) as CIE XYZ. Both directions point away
//! from the surface; a mirror reflects phi to phi + 180 degrees.

mod file;
mod open_material;
mod read;
mod set_files;
mod write;

pub(super) use file::has_signature;
pub(super) use open_material::read_open_material;
pub use open_material::to_open_material;
pub use read::PabSet;
pub(super) use read::read_pab;
pub(super) use set_files::files_of;
pub use write::{pab_suffixes, to_pab};

/// The difference in degrees below which two angles count as equal.
const ANGLE_TOLERANCE: f64 = 0.01;

/// Returns the product of a matrix and a vector.
fn product(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

/// Returns the unit vector with polar angle `theta` and azimuth `phi`, in degrees.
fn direction(theta: f64, phi: f64) -> [f64; 3] {
    let (sin, cos) = theta.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi.to_radians().sin_cos();
    [sin * cos_phi, sin * sin_phi, cos]
}
