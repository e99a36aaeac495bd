//! A picture of linear radiance, and the one way it is shown.

use super::Picture;

/// Radiance is multiplied by this before anything else.
const EXPOSURE: f32 = 1.7;

/// Linear radiance, pixel by pixel, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// width x height pixels in linear RGB.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// One radiance everywhere.
    #[must_use]
    pub fn filled(width: usize, height: usize, radiance: [f32; 3]) -> Self {
        Self {
            width,
            height,
            pixels: vec![radiance; width * height],
        }
    }

    /// What is shown, written and measured: each channel x is exposed and compressed like film,
    /// to 1 - exp(-1.7 x), encoded by sRGB's transfer function and rounded to 8 bits. What is
    /// negative or not a number is black.
    #[must_use]
    pub fn tone_map(&self) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(|pixel| pixel.map(display)).collect(),
        }
    }
}

/// One channel of a pixel, as [`Image::tone_map`] says.
fn display(radiance: f32) -> u8 {
    let compressed = -(-EXPOSURE * radiance.max(0.0)).exp_m1();
    // `as` makes a NaN 0.
    (255.0 * srgb(compressed)).round() as u8
}

/// The transfer function of IEC 61966-2-1.
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_runs_from_black_to_white() {
        let shown = [0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 9.0, f32::INFINITY].map(display);
        assert_eq!(shown, [0, 0, 0, 0, 255, 255]);
        // By hand: 1 is compressed to 1 - exp(-1.7) = 0.81732, which sRGB shows as 0.91491.
        assert_eq!(display(1.0), 233);
        // In the linear part of sRGB: 0.0016986 x 12.92 x 255 = 5.60.
        assert_eq!(display(0.001), 6);
        let ramp: Vec<u8> = (0..=800).map(|i| display(i as f32 / 100.0)).collect();
        assert!(ramp.is_sorted());
    }
}
