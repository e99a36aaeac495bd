//! Conversions between linear RGB and CIE XYZ.

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
