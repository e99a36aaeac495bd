//! Rasters of pixels, and pictures of 8 bits per channel for pages, PNG files and image metrics.

/// An error of the PNG encoder: a side is 0, or the number of pixels is not width x height.
pub type PictureError = png::EncodingError;

/// Pixels row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster<P> {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// width x height pixels.
    pub pixels: Vec<P>,
}

/// An 8-bit sRGB picture.
pub type Picture = Raster<[u8; 3]>;

impl<P: Clone> Raster<P> {
    /// Creates a raster with equal pixels.
    #[must_use]
    pub fn filled(width: usize, height: usize, pixel: P) -> Self {
        Self {
            width,
            height,
            pixels: vec![pixel; width * height],
        }
    }
}

impl<P: Copy + Default> Raster<P> {
    /// Arranges images of the same size in rows of `columns` images, with gaps of `gap` pixels that are 0.
    #[must_use]
    pub fn grid(images: &[Self], columns: usize, gap: usize) -> Self {
        let (width, height) = images.first().map_or((0, 0), |one| (one.width, one.height));
        let columns = columns.clamp(1, images.len().max(1));
        let end = |count: usize, side: usize| (count * (side + gap)).saturating_sub(gap);
        let rows = images.len().div_ceil(columns);
        let mut grid = Self::filled(end(columns, width), end(rows, height), P::default());
        for (index, image) in images.iter().enumerate() {
            let left = index % columns * (width + gap);
            let top = index / columns * (height + gap);
            let lines = grid.pixels.chunks_exact_mut(grid.width.max(1)).skip(top);
            for (to, from) in lines.zip(image.pixels.chunks_exact(width.max(1))) {
                for (to, from) in to.iter_mut().skip(left).zip(from) {
                    *to = *from;
                }
            }
        }
        grid
    }
}

impl Picture {
    /// Encodes the picture as a PNG file, marked as sRGB.
    ///
    /// # Errors
    /// If a side is 0 or the number of pixels is not width x height.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        self.encode(self.pixels.as_flattened(), png::BitDepth::Eight)
    }
}

impl<P> Raster<P> {
    /// Encodes RGB samples as a PNG file: of 8 bits, marked as sRGB, or else linear, with a gamma of 1.
    pub(super) fn encode(
        &self,
        samples: &[u8],
        depth: png::BitDepth,
    ) -> Result<Vec<u8>, PictureError> {
        let mut file = Vec::new();
        // The encoder rejects a side above u32::MAX, because it does not match the number of pixels.
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
        let mut encoder = png::Encoder::new(&mut file, side(self.width), side(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(depth);
        match depth {
            png::BitDepth::Eight => encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual),
            _ => encoder.set_source_gamma(png::ScaledFloat::new(1.0)),
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(samples)?;
        writer.finish()?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [u8; 3] = [255, 0, 0];

    #[test]
    fn rejects_wrong_pixel_count() {
        assert!(Picture::filled(0, 3, RED).to_png().is_err());
        let short = Picture {
            width: 3,
            height: 3,
            pixels: vec![RED; 8],
        };
        assert!(short.to_png().is_err());
    }
}
