//! Images of linear radiance, and their tone mapping.

use glimpse_materials::to_npy;

use super::Picture;

/// The factor by which tone mapping multiplies the radiance first.
const EXPOSURE: f32 = 1.7;

/// An image of linear radiance, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// width x height pixels in linear RGB.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Creates an image with the same radiance in all pixels.
    #[must_use]
    pub fn filled(width: usize, height: usize, radiance: [f32; 3]) -> Self {
        Self {
            width,
            height,
            pixels: vec![radiance; width * height],
        }
    }

    /// Arranges rows of images in a grid, each image in the top left of its cell. A column is as wide as its widest
    /// image, and a row as high as its highest one. Gaps of `gap` pixels and empty space have the radiance `radiance`.
    #[must_use]
    pub fn grid<Row: AsRef<[Self]>>(rows: &[Row], gap: usize, radiance: [f32; 3]) -> Self {
        let rows: Vec<&[Self]> = rows.iter().map(AsRef::as_ref).collect();
        let columns = rows.iter().map(|row| row.len()).max().unwrap_or(0);
        let widest = |column: usize| {
            rows.iter()
                .filter_map(|row| row.get(column))
                .map(|image| image.width)
                .max()
        };
        let highest = |row: &&[Self]| row.iter().map(|image| image.height).max().unwrap_or(0);
        let (lefts, width) = offsets((0..columns).map(|column| widest(column).unwrap_or(0)), gap);
        let (tops, height) = offsets(rows.iter().map(highest), gap);
        let mut grid = Self::filled(width, height, radiance);
        for (row, top) in rows.iter().zip(tops) {
            for (image, &left) in row.iter().zip(&lefts) {
                grid.paste(image, left, top);
            }
        }
        grid
    }

    /// Copies an image into this one, with its top left pixel at (left, top). Pixels beyond the edges are dropped.
    fn paste(&mut self, image: &Self, left: usize, top: usize) {
        let rows = self.pixels.chunks_exact_mut(self.width.max(1)).skip(top);
        for (to, from) in rows.zip(image.pixels.chunks_exact(image.width.max(1))) {
            for (to, from) in to.iter_mut().skip(left).zip(from) {
                *to = *from;
            }
        }
    }

    /// Encodes the linear radiance as a NumPy file: 32-bit floats of shape (height, width, 3).
    #[must_use]
    pub fn to_npy(&self) -> Vec<u8> {
        let shape = [self.height as u64, self.width as u64, 3];
        to_npy(&shape, self.pixels.as_flattened())
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

/// Returns the offsets of consecutive lengths with gaps between them, and the end of the last one.
fn offsets(lengths: impl Iterator<Item = usize>, gap: usize) -> (Vec<usize>, usize) {
    let mut end = 0;
    let starts = lengths.enumerate().map(|(index, length)| {
        let start = if index == 0 { 0 } else { end + gap };
        end = start + length;
        start
    });
    (starts.collect(), end)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [f32; 3] = [1.0, 0.0, 0.0];
    const BLUE: [f32; 3] = [0.0, 0.0, 1.0];
    const GRAY: [f32; 3] = [0.5; 3];

    #[test]
    fn grid_keeps_all_images_and_fills_gaps() {
        let red = Image::filled(2, 1, RED);
        let blue = Image::filled(1, 2, BLUE);
        let grid = Image::grid(&[vec![red.clone(), blue.clone()], vec![blue]], 1, GRAY);
        assert_eq!((grid.width, grid.height), (4, 5));
        #[rustfmt::skip]
        let expected = [
            RED,  RED,  GRAY, BLUE,
            GRAY, GRAY, GRAY, BLUE,
            GRAY, GRAY, GRAY, GRAY,
            BLUE, GRAY, GRAY, GRAY,
            BLUE, GRAY, GRAY, GRAY,
        ];
        assert_eq!(grid.pixels, expected);
        assert_eq!(Image::grid(&[[red.clone()]], 3, GRAY), red);
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
