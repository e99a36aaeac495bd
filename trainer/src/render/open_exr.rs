//! Images as OpenEXR files.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{SpecificChannels, Vec2, WritableImage};
use glimpse_materials::files::write_atomic;

use super::{Image, PictureError};

impl Image {
    /// Encodes the image as an OpenEXR file: channels R, G and B in 32-bit floats, losslessly compressed, neither
    /// exposed nor tone-mapped.
    ///
    /// # Errors
    /// If a side is 0 or the number of pixels is not width x height.
    pub fn to_exr(&self) -> Result<Vec<u8>, PictureError> {
        let Self { width, height, .. } = *self;
        let encode_error = |reason: String| PictureError::EncodeExr {
            width,
            height,
            reason,
        };
        if self.pixels.is_empty() || width.checked_mul(height) != Some(self.pixels.len()) {
            return Err(encode_error(format!(
                "it holds {} pixels",
                self.pixels.len()
            )));
        }
        let pixel = |position: Vec2<usize>| {
            let pixel = self.pixels.get(position.y() * width + position.x());
            <(f32, f32, f32)>::from(pixel.copied().unwrap_or_default())
        };
        let mut file = Cursor::new(Vec::new());
        exr::prelude::Image::from_channels((width, height), SpecificChannels::rgb(pixel))
            .write()
            .non_parallel()
            .to_buffered(&mut file)
            .map_err(|error| encode_error(error.to_string()))?;
        Ok(file.into_inner())
    }

    /// Writes the image atomically as an OpenEXR file.
    ///
    /// # Errors
    /// As [`Image::to_exr`], or if the file cannot be written.
    pub fn write_exr(&self, path: &Path) -> Result<(), PictureError> {
        write_atomic(path, &self.to_exr()?).map_err(|source| PictureError::Write {
            path: path.into(),
            source,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_exr_round_trip_is_exact() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("sphere.exr");
        let image = Image {
            width: 5,
            height: 3,
            pixels: (0..15_u8)
                .map(|i| [f32::from(i) / 7.0, 1e-30, 1e6 + f32::from(i)])
                .collect(),
        };
        image.write_exr(&path).unwrap();
        let read = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| vec![[0.0_f32; 3]; size.area()],
            |pixels, position, (r, g, b, _): (f32, f32, f32, f32)| {
                pixels[position.y() * 5 + position.x()] = [r, g, b]
            },
        );
        let layer = read.unwrap().layer_data;
        assert_eq!((layer.size.width(), layer.size.height()), (5, 3));
        assert_eq!(layer.channel_data.pixels, image.pixels);
    }

    #[test]
    fn rejects_wrong_pixel_count() {
        let mut image = Image::filled(3, 3, [0.5; 3]);
        image.pixels.pop();
        for image in [
            image,
            Image::filled(0, 3, [0.5; 3]),
            Image::filled(0, 0, [0.5; 3]),
        ] {
            assert!(matches!(
                image.to_exr(),
                Err(PictureError::EncodeExr { .. })
            ));
        }
    }
}
