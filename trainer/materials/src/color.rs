//! Conversions between linear RGB and CIE XYZ.

use std::iter::Sum;
use std::ops::Mul;

/// The matrix from linear RGB (Rec. 709, D65) to CIE XYZ, row by row.
pub(crate) const TO_XYZ: [[f64; 3]; 3] = [
    [0.412_391, 0.357_584, 0.180_481],
    [0.212_639, 0.715_169, 0.072_192],
    [0.019_331, 0.119_195, 0.950_532],
];
/// The inverse of [`TO_XYZ`].
pub(crate) const FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_970, -1.537_383, -0.498_611],
    [-0.969_244, 1.875_968, 0.041_555],
    [0.055_630, -0.203_977, 1.056_972],
];
/// The matrix that changes no color.
pub(crate) const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Returns the product of a matrix and a vector.
pub(crate) fn product<T: Copy + Mul<Output = T> + Sum, const N: usize>(
    matrix: &[[T; 3]; N],
    vector: [T; 3],
) -> [T; N] {
    matrix.map(|row| row.into_iter().zip(vector).map(|(a, b)| a * b).sum())
}
