//! Pictures of 8 bits per channel, for pages, PNG files and image metrics.

/// An error in encoding a picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// A side is 0, or the number of pixels is not width x height.
    #[error(
        "a picture of {width} x {height} pixels with {pixels} pixels in memory cannot be written as PNG: {source}"
    )]
    EncodePng {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Number of pixels in memory.
        pixels: usize,
        /// Error of the encoder.
        source: png::EncodingError,
    },
}

/// An 8-bit sRGB picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// width x height pixels, sRGB.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Creates a picture of one color.
    #[must_use]
    pub fn filled(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self {
            width,
            height,
            pixels: vec![color; width * height],
        }
    }

    /// Encodes the picture as a PNG file, marked as sRGB.
    ///
    /// # Errors
    /// If a side is 0 or the number of pixels is not width x height.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        let mut file = Vec::new();
        self.encode(&mut file)
            .map_err(|source| PictureError::EncodePng {
                width: self.width,
                height: self.height,
                pixels: self.pixels.len(),
                source,
            })?;
        Ok(file)
    }

    fn encode(&self, file: &mut Vec<u8>) -> Result<(), png::EncodingError> {
        // The encoder rejects a side above u32::MAX, because it does not match the number of pixels.
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
        let mut encoder = png::Encoder::new(file, side(self.width), side(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [u8; 3] = [255, 0, 0];

    #[test]
    fn png_round_trip_is_exact() {
        let picture = Picture {
            width: 5,
            height: 3,
            pixels: (0..15).map(|i| [i, 100 + i, 255 - 3 * i]).collect(),
        };
        let file = std::io::Cursor::new(picture.to_png().unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(bytes, picture.pixels.as_flattened());
    }

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
