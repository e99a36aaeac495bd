//! Pictures of 8 bits a channel: what is on the page and in the PNG file, and what is measured.

use std::io;
use std::path::{Path, PathBuf};

use crate::files::write_whole;

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The operating system refuses.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is nothing in it, or it has not as many pixels as it says.
    #[error(
        "a picture of {width} x {height} pixels that holds {pixels} cannot be written as PNG: {source}"
    )]
    Encode {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels it holds.
        pixels: usize,
        /// Why.
        source: png::EncodingError,
    },
}

/// An sRGB picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// width x height pixels, sRGB.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// One colour everywhere.
    #[must_use]
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self {
            width,
            height,
            pixels: vec![colour; width * height],
        }
    }

    /// Pictures side by side, `gap` pixels of `colour` between them.
    #[must_use]
    pub fn row(pictures: &[Self], gap: usize, colour: [u8; 3]) -> Self {
        Self::grid(&[pictures], gap, colour)
    }

    /// Rows of pictures below each other, each in the top left of its cell; columns and rows are
    /// as wide and high as their largest picture, with `gap` pixels of `colour` between them.
    #[must_use]
    pub fn grid<Row: AsRef<[Self]>>(rows: &[Row], gap: usize, colour: [u8; 3]) -> Self {
        let rows: Vec<&[Self]> = rows.iter().map(AsRef::as_ref).collect();
        let columns = rows.iter().map(|row| row.len()).max().unwrap_or(0);
        let widest = |column: usize| {
            rows.iter()
                .filter_map(|row| row.get(column))
                .map(|p| p.width)
                .max()
        };
        let highest = |row: &&[Self]| row.iter().map(|picture| picture.height).max().unwrap_or(0);
        let (lefts, width) = places((0..columns).map(|column| widest(column).unwrap_or(0)), gap);
        let (tops, height) = places(rows.iter().map(highest), gap);
        let mut sheet = Self::filled(width, height, colour);
        for (row, top) in rows.iter().zip(tops) {
            for (picture, &left) in row.iter().zip(&lefts) {
                sheet.paste(picture, left, top);
            }
        }
        sheet
    }

    /// Copies a picture into this one; what sticks out is cut off.
    fn paste(&mut self, picture: &Self, left: usize, top: usize) {
        let rows = self.pixels.chunks_exact_mut(self.width.max(1)).skip(top);
        for (to, from) in rows.zip(picture.pixels.chunks_exact(picture.width.max(1))) {
            for (to, from) in to.iter_mut().skip(left).zip(from) {
                *to = *from;
            }
        }
    }

    /// The picture as a PNG file, marked as sRGB.
    ///
    /// # Errors
    /// If a side is 0 or the number of pixels is not width x height.
    pub fn to_png(&self) -> Result<Vec<u8>, PictureError> {
        let mut file = Vec::new();
        self.encode(&mut file)
            .map_err(|source| PictureError::Encode {
                width: self.width,
                height: self.height,
                pixels: self.pixels.len(),
                source,
            })?;
        Ok(file)
    }

    fn encode(&self, file: &mut Vec<u8>) -> Result<(), png::EncodingError> {
        // Too long a side is refused below, because it does not match the number of pixels.
        let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
        let mut encoder = png::Encoder::new(file, side(self.width), side(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()
    }

    /// Writes the picture as a PNG file, whole or not at all.
    ///
    /// # Errors
    /// As [`Picture::to_png`], or if the file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), PictureError> {
        write_whole(path, &self.to_png()?).map_err(|source| PictureError::Write {
            path: path.into(),
            source,
        })
    }
}

/// Where each of several lengths begins, put end to end with gaps, and where the last one ends.
fn places(lengths: impl Iterator<Item = usize>, gap: usize) -> (Vec<usize>, usize) {
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

    const RED: [u8; 3] = [255, 0, 0];
    const BLUE: [u8; 3] = [0, 0, 255];
    const GREY: [u8; 3] = [9, 9, 9];

    #[test]
    fn a_grid_keeps_every_picture_and_fills_the_rest() {
        let red = Picture::filled(2, 1, RED);
        let blue = Picture::filled(1, 2, BLUE);
        let grid = Picture::grid(&[vec![red.clone(), blue.clone()], vec![blue]], 1, GREY);
        assert_eq!((grid.width, grid.height), (4, 5));
        #[rustfmt::skip]
        let expected = [
            RED,  RED,  GREY, BLUE,
            GREY, GREY, GREY, BLUE,
            GREY, GREY, GREY, GREY,
            BLUE, GREY, GREY, GREY,
            BLUE, GREY, GREY, GREY,
        ];
        assert_eq!(grid.pixels, expected);
        assert_eq!(Picture::row(std::slice::from_ref(&red), 3, GREY), red);
    }

    #[test]
    fn a_png_file_gives_the_picture_back() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("picture.png");
        let picture = Picture {
            width: 5,
            height: 3,
            pixels: (0..15).map(|i| [i, 100 + i, 255 - 3 * i]).collect(),
        };
        picture.write_png(&path).unwrap();
        let file = io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (5, 3));
        assert_eq!(bytes, picture.pixels.as_flattened());
    }

    #[test]
    fn impossible_pictures_are_refused() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("picture.png");
        let none: [Picture; 0] = [];
        assert!(Picture::row(&none, 2, GREY).write_png(&path).is_err());
        let short = Picture {
            width: 3,
            height: 3,
            pixels: vec![RED; 8],
        };
        assert!(short.write_png(&path).is_err());
        assert!(!path.exists());
    }
}
