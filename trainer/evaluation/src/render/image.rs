//! Images of linear radiance, and their tone mapping.

use glimpse_materials::to_npy;

use super::{Picture, PictureError, Raster};

/// The factor by which tone mapping multiplies the radiance first.
const EXPOSURE: f32 = 1.7;

/// An image of linear radiance, in linear RGB.
pub type Image = Raster<[f32; 3]>;

impl Image {
    /// Encodes linear pixels, whose full scale is 1, as a PNG file of 16 bits. Its gamma is 1.
    ///
    /// # Errors
    /// If a side is 0 or the number of pixels is not width x height.
    pub fn to_linear_png(&self) -> Result<Vec<u8>, PictureError> {
        // `as` saturates, and converts NaN to 0.
        let sample = |value: &f32| ((65_535.0 * value).round() as u16).to_be_bytes();
        let samples = self.pixels.as_flattened().iter().flat_map(sample);
        self.encode(&samples.collect::<Vec<_>>(), png::BitDepth::Sixteen)
    }

    /// Encodes the linear radiance as a NumPy file: 32-bit floats of shape (height, width, 3).
    #[must_use]
    pub fn to_npy(&self) -> Vec<u8> {
        to_npy(&[self.height, self.width, 3], self.pixels.as_flattened())
    }

    /// Converts radiance to 8-bit sRGB. Each channel x is compressed to 1 - exp(-1.7 x), like the response of film,
    /// then encoded with sRGB's transfer function and rounded. Negative values and NaN become black.
    #[must_use]
    pub fn tone_map(&self) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            pixels: self
                .pixels
                .iter()
                .map(|pixel| pixel.map(to_display))
                .collect(),
        }
    }
}

/// Tone-maps one channel of a pixel, as described at [`Image::tone_map`].
fn to_display(radiance: f32) -> u8 {
    let compressed = -(-EXPOSURE * radiance.max(0.0)).exp_m1();
    // `as` converts NaN to 0.
    (255.0 * srgb(compressed)).round() as u8
}

/// Applies the sRGB transfer function of IEC 61966-2-1.
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

    const RED: [f32; 3] = [1.0, 0.0, 0.0];
    const BLUE: [f32; 3] = [0.0, 0.0, 1.0];
    const GAP: [f32; 3] = [0.0; 3];

    #[test]
    fn grid_keeps_all_images_and_fills_gaps() {
        let red = Image::filled(2, 1, RED);
        let blue = Image::filled(2, 1, BLUE);
        let grid = Image::grid(&[red.clone(), blue.clone(), blue], 2, 1);
        assert_eq!((grid.width, grid.height), (5, 3));
        #[rustfmt::skip]
        let expected = [
            RED,  RED,  GAP, BLUE, BLUE,
            GAP,  GAP,  GAP, GAP,  GAP,
            BLUE, BLUE, GAP, GAP,  GAP,
        ];
        assert_eq!(grid.pixels, expected);
        assert_eq!(Image::grid(std::slice::from_ref(&red), 8, 3), red);
    }

    #[test]
    fn tone_curve_runs_from_black_to_white() {
        let displayed =
            [0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 9.0, f32::INFINITY].map(to_display);
        assert_eq!(displayed, [0, 0, 0, 0, 255, 255]);
        // 1 is compressed to 1 - exp(-1.7) = 0.81732, which sRGB encodes as 0.91491.
        assert_eq!(to_display(1.0), 233);
        // In the linear part of sRGB: 0.0016986 x 12.92 x 255 = 5.60.
        assert_eq!(to_display(0.001), 6);
        let ramp: Vec<u8> = (0..=800).map(|i| to_display(i as f32 / 100.0)).collect();
        assert!(ramp.is_sorted());
    }
}
