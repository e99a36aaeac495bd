//! PAB-Opto "Mountain" text: the output of PAB-Opto's goniophotometers, and the input of Radiance's `pabopto2bsdf`.
//!
//! There is one file per incoming direction. Its header lines start with `#`. One line follows per outgoing direction:
//! theta_o and phi_o in degrees, and the BRDF in sr^-1 (not times the cosine) as CIE XYZ. Both directions point away
//! from the surface; a mirror reflects phi to phi + 180 degrees.

mod file;
mod read;
mod write;

pub(super) use file::has_signature;
pub(super) use read::files_of;
pub use read::{PabSet, read_pab};
pub use write::{pab_suffixes, to_pab};

/// The matrix from linear RGB (Rec. 709, D65) to CIE XYZ, row by row.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.412_391, 0.357_584, 0.180_481],
    [0.212_639, 0.715_169, 0.072_192],
    [0.019_331, 0.119_195, 0.950_532],
];
/// The inverse of [`TO_XYZ`].
const FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_970, -1.537_383, -0.498_611],
    [-0.969_244, 1.875_968, 0.041_555],
    [0.055_630, -0.203_977, 1.056_972],
];

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
