//! Colors in CIELAB, and their difference CIEDE2000.
//!
//! The formula is that of Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula: implementation notes,
//! supplementary test data, and mathematical observations", Color Research and Application 30 (2005), with
//! kL = kC = kH = 1. The difference has no unit and no upper bound: it is 0 for equal colors, about 1 for a just
//! noticeable difference, and 100 for black and white.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

/// Linear sRGB to CIE XYZ, row by row.
const XYZ_OF_RGB: [[f64; 3]; 3] = [
    [0.412_453, 0.357_580, 0.180_423],
    [0.212_671, 0.715_160, 0.072_169],
    [0.019_334, 0.119_193, 0.950_227],
];
/// XYZ of the white point D65 for the observer of 2 degrees.
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];
/// 25^7, the scale of chroma in the corrections for neutral and for blue colors.
const CHROMA_SCALE: f64 = 6_103_515_625.0;

/// The linear value of each 8-bit sRGB level, in \[0, 1\].
static LINEAR: LazyLock<[f64; 256]> = LazyLock::new(|| {
    std::array::from_fn(|level| {
        let encoded = level as f64 / 255.0;
        if encoded > 0.040_45 {
            ((encoded + 0.055) / 1.055).powf(2.4)
        } else {
            encoded / 12.92
        }
    })
});

/// A color in CIELAB: L\* in \[0, 100\], a\* and b\*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lab {
    /// Lightness.
    pub l: f64,
    /// Green (negative) to red.
    pub a: f64,
    /// Blue (negative) to yellow.
    pub b: f64,
}

impl Lab {
    /// Converts an 8-bit sRGB color.
    #[must_use]
    pub fn from_srgb(srgb: [u8; 3]) -> Self {
        Self::from_linear(srgb.map(|level| LINEAR[usize::from(level)]))
    }

    /// Converts linear RGB, 0 to 1.
    #[must_use]
    pub fn from_linear(linear: [f64; 3]) -> Self {
        Self::from_relative_xyz(std::array::from_fn(|row| {
            let products = XYZ_OF_RGB[row].iter().zip(linear);
            let sum: f64 = products.map(|(weight, channel)| weight * channel).sum();
            sum / WHITE[row]
        }))
    }

    /// Converts X, Y and Z, each relative to that of white.
    #[must_use]
    pub fn from_relative_xyz(xyz: [f64; 3]) -> Self {
        let [x, y, z] = xyz.map(lightness_response);
        Self {
            l: 116.0 * y - 16.0,
            a: 500.0 * (x - y),
            b: 200.0 * (y - z),
        }
    }

    /// Converts to X, Y and Z, each relative to that of white.
    pub fn to_relative_xyz(self) -> [f64; 3] {
        let y = (self.l + 16.0) / 116.0;
        let responses = [y + self.a / 500.0, y, y - self.b / 200.0];
        responses.map(|response| {
            let cube = response.powi(3);
            if cube > 0.008_856 {
                cube
            } else {
                (response - 16.0 / 116.0) / 7.787
            }
        })
    }
}

/// CIELAB's compression of a relative tristimulus value.
fn lightness_response(t: f64) -> f64 {
    if t > 0.008_856 {
        t.cbrt()
    } else {
        7.787 * t + 16.0 / 116.0
    }
}

/// Returns the CIEDE2000 difference of two colors, 0 or more. It is symmetric.
///
/// The symbols are those of Sharma, Wu and Dalal.
#[must_use]
pub fn ciede2000(one: Lab, other: Lab) -> f64 {
    let chroma_factor = |chroma: f64| {
        let power = chroma.powi(7);
        (power / (power + CHROMA_SCALE)).sqrt()
    };
    let mean_c = 0.5 * (one.a.hypot(one.b) + other.a.hypot(other.b));
    let g = 0.5 * (1.0 - chroma_factor(mean_c));
    let polar = |color: Lab| {
        let a = (1.0 + g) * color.a;
        (a.hypot(color.b), color.b.atan2(a).rem_euclid(TAU))
    };
    let ((c1, h1), (c2, h2)) = (polar(one), polar(other));
    let is_neutral = c1 * c2 == 0.0;

    let delta_h = match h2 - h1 {
        _ if is_neutral => 0.0,
        difference if difference > PI => difference - TAU,
        difference if difference < -PI => difference + TAU,
        difference => difference,
    };
    let mean_h = match h1 + h2 {
        sum if is_neutral => sum,
        sum if (h1 - h2).abs() <= PI => 0.5 * sum,
        sum if sum < TAU => 0.5 * (sum + TAU),
        sum => 0.5 * (sum - TAU),
    };
    let mean_l = 0.5 * (one.l + other.l);
    let mean_c = 0.5 * (c1 + c2);

    let cosine = |multiple: f64, degrees: f64| (multiple * mean_h + degrees.to_radians()).cos();
    let t = 1.0 - 0.17 * cosine(1.0, -30.0) + 0.24 * cosine(2.0, 0.0) + 0.32 * cosine(3.0, 6.0)
        - 0.20 * cosine(4.0, -63.0);
    let squared_l = (mean_l - 50.0).powi(2);
    let s_l = 1.0 + 0.015 * squared_l / (20.0 + squared_l).sqrt();
    let s_c = 1.0 + 0.045 * mean_c;
    let s_h = 1.0 + 0.015 * mean_c * t;
    let hue_offset = (mean_h.to_degrees() - 275.0) / 25.0;
    let delta_theta = (30.0 * (-hue_offset * hue_offset).exp()).to_radians();
    let r_t = -(2.0 * delta_theta).sin() * 2.0 * chroma_factor(mean_c);

    let lightness = (other.l - one.l) / s_l;
    let chroma = (c2 - c1) / s_c;
    let hue = 2.0 * (c1 * c2).sqrt() * (0.5 * delta_h).sin() / s_h;
    let sum = lightness * lightness + chroma * chroma + hue * hue + r_t * chroma * hue;
    sum.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 of Sharma, Wu and Dalal: two colors in CIELAB and their difference.
    #[rustfmt::skip]
    const PAIRS: [[f64; 7]; 34] = [
        [50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425],
        [50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615],
        [50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412],
        [50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000],
        [50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669],
        [50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195],
        [50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0010, -2.4900, 4.8045],
        [50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461],
        [50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065],
        [50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492],
        [50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977],
        [50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030],
        [50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000],
        [50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ];

    #[test]
    fn matches_published_differences() {
        for [l1, a1, b1, l2, a2, b2, expected] in PAIRS {
            let [one, other] = [[l1, a1, b1], [l2, a2, b2]].map(|[l, a, b]| Lab { l, a, b });
            for difference in [ciede2000(one, other), ciede2000(other, one)] {
                assert!(
                    (difference - expected).abs() < 5e-5,
                    "{one:?} {other:?}: {difference}"
                );
            }
        }
    }

    /// Expected values: scikit-image 0.26, `rgb2lab`.
    #[test]
    fn lab_matches_scikit_image() {
        for (srgb, expected) in [
            ([255, 255, 255], [100.0, -0.002_454_9, 0.004_653_4]),
            ([255, 0, 0], [53.240_587_9, 80.092_308_2, 67.202_751]),
            ([0, 0, 255], [32.295_672_6, 79.185_590_9, -107.857_300_2]),
            ([10, 5, 3], [1.622_837_6, 1.029_321_9, 1.217_704_7]),
            ([128, 64, 200], [41.884_782_3, 53.521_301_7, -60.355_009_6]),
            ([0, 0, 0], [0.0; 3]),
        ] {
            let Lab { l, a, b } = Lab::from_srgb(srgb);
            for (value, expected) in [l, a, b].into_iter().zip(expected) {
                assert!((value - expected).abs() < 1e-6, "{srgb:?}: {value}");
            }
        }
    }
}
