//! The reader of environments: panoramas in latitude and longitude, as Radiance files.

use std::io::{BufRead, BufReader, Seek};
use std::path::{Path, PathBuf};

use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;

use super::{Environment, Image};
use glimpse_materials::untrusted::{escaped, open_at_most};

/// Maximum number of pixels: 8192 x 4096.
const MAX_PIXELS: u64 = 1 << 25;
/// Maximum file size in bytes: 32 bytes per pixel of the largest panorama, uncompressed.
const MAX_BYTES: u64 = 32 * MAX_PIXELS;
/// Maximum number of pixels per byte of a file. The format does not compress better, so a header that claims more is
/// rejected.
const MAX_PIXELS_PER_BYTE: u64 = 10_000;

/// An error in reading an environment.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The operating system cannot read the file.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file name has an unknown extension.
    #[error(
        "{} is not an environment: give a panorama in latitude and longitude, as Radiance (*.hdr)",
        .0.display()
    )]
    UnknownFormat(PathBuf),
    /// The content does not match the extension, or is not a usable panorama.
    #[error("{}: {problem}", path.display())]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// The problem and the remedy.
        problem: String,
    },
}

impl Environment {
    /// Reads a panorama in latitude and longitude: Radiance (`*.hdr`, RGBE), linear RGB.
    ///
    /// The panorama is the view from the sphere's position. Its center is straight ahead of the viewer, behind the
    /// sphere. Right of the center is the viewer's right; the left and right edges meet behind the viewer. The top row
    /// is straight up. Negative radiance, a result of color conversions, counts as black.
    ///
    /// All radiance is scaled so that a white diffuse sphere has the same mean luminance over its visible disc as in
    /// the [`studio`](Environment::studio).
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, its sides are not 2:1, it has more than 2^25 pixels, a pixel is
    /// infinite or not a number, or all pixels are black.
    pub fn read(path: &Path) -> Result<Self, EnvironmentError> {
        let damaged = |problem| EnvironmentError::Damaged {
            path: path.into(),
            problem,
        };
        Self::from_panorama(&Image::read_panorama(path)?).map_err(damaged)
    }
}

impl Image {
    /// Reads the pixels of a panorama without changes; see [`Environment::read`] for format and layout.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, or it has more than 2^25 pixels.
    pub fn read_panorama(path: &Path) -> Result<Self, EnvironmentError> {
        let read_error = |source| EnvironmentError::Read {
            path: path.into(),
            source,
        };
        let extension = path.extension().unwrap_or_default();
        if !["hdr", "pic"]
            .iter()
            .any(|known| extension.eq_ignore_ascii_case(known))
        {
            return Err(EnvironmentError::UnknownFormat(path.into()));
        }
        let file = open_at_most(path, MAX_BYTES).map_err(read_error)?;
        let bytes = file.metadata().map_err(read_error)?.len();
        decode_radiance(BufReader::new(file), bytes).map_err(|problem| EnvironmentError::Damaged {
            path: path.into(),
            problem,
        })
    }
}

/// Rejects a size above [`MAX_PIXELS`], or above the capacity of a file of `bytes` bytes.
fn check_size(width: u64, height: u64, bytes: u64) -> Result<(), String> {
    let pixels = width.saturating_mul(height);
    if pixels > MAX_PIXELS {
        Err(format!(
            "{width} x {height} pixels are too many: scale it down to 8192 x 4096 or less"
        ))
    } else if pixels > bytes.saturating_mul(MAX_PIXELS_PER_BYTE) {
        Err(format!(
            "{width} x {height} pixels do not fit in {bytes} bytes: the file is damaged or cut off, \
             fetch it again"
        ))
    } else {
        Ok(())
    }
}

/// Decodes a Radiance file. Its EXPOSURE is ignored, because [`Environment::read`] sets the exposure.
fn decode_radiance<R: BufRead + Seek>(mut file: R, bytes: u64) -> Result<Image, String> {
    let damaged = |error: &dyn std::fmt::Display| {
        let error = escaped(&error.to_string());
        format!("not a complete Radiance file (*.hdr): {error}; fetch it or save it again, as RGBE")
    };
    let mut magic = [0; 2];
    let magic_read = file.read_exact(&mut magic).and_then(|()| file.rewind());
    magic_read.map_err(|error| damaged(&error))?;
    if &magic != b"#?" {
        return Err(damaged(&"it does not begin with #?"));
    }
    // Strict decoding would reject the common first line #?RGBE.
    let decoder = HdrDecoder::new_nonstrict(file).map_err(|error| damaged(&error))?;
    let metadata = decoder.metadata();
    check_size(metadata.width.into(), metadata.height.into(), bytes)?;
    let (width, height) = (metadata.width as usize, metadata.height as usize);
    let mut content = vec![0; width * height * size_of::<[f32; 3]>()];
    decoder
        .read_image(&mut content)
        .map_err(|error| damaged(&error))?;
    let (floats, _) = content.as_chunks();
    let floats: Vec<f32> = floats
        .iter()
        .map(|&float| f32::from_ne_bytes(float))
        .collect();
    Ok(Image {
        width,
        height,
        pixels: floats.as_chunks().0.to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 16;
    const HEIGHT: usize = 8;

    /// Returns an uncompressed Radiance file in which all pixels but one are equal; that one is brighter.
    fn radiance_file(size: &str) -> Vec<u8> {
        let mut file = format!("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
        for index in 0..WIDTH * HEIGHT {
            // RGBE: mantissa / 256 x 2^(exponent - 128).
            let exponent = if index == 3 * WIDTH + 12 { 133 } else { 128 };
            file.extend([128, 64, 32, exponent]);
        }
        file
    }

    fn read(name: &str, bytes: &[u8]) -> Result<Environment, EnvironmentError> {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Environment::read(&path)
    }

    /// Returns the problem of a damaged file, and checks that the error names the file.
    fn problem_of(name: &str, bytes: &[u8]) -> String {
        match read(name, bytes).map(|_| ()) {
            Err(EnvironmentError::Damaged { path, problem }) if path.ends_with(name) => problem,
            other => panic!("{name}: {other:?}"),
        }
    }

    fn valid_file() -> Vec<u8> {
        radiance_file(&format!("-Y {HEIGHT} +X {WIDTH}"))
    }

    #[test]
    fn radiance_is_decoded_and_oriented() {
        let mut panorama = Image::filled(WIDTH, HEIGHT, [0.5, 0.25, 0.125]);
        panorama.pixels[3 * WIDTH + 12] = [16.0, 8.0, 4.0];
        let expected = Environment::from_panorama(&panorama).unwrap();
        let radiance = read("a.HDR", &valid_file()).unwrap();
        // Column 12 of 16 is just over a quarter turn to the right of the center, row 3 just above the horizon.
        let [r, g, b] = expected.radiance([0.962, 0.195, 0.191]);
        assert!(r > 10.0 * expected.radiance([-1.0, 0.0, 0.0])[0]);
        assert!((r / g - 2.0).abs() < 1e-5 && (g / b - 2.0).abs() < 1e-5);
        for direction in [[0.962, 0.195, 0.191], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]] {
            assert_eq!(radiance.radiance(direction), expected.radiance(direction));
        }
    }

    #[test]
    fn rejects_file_without_panorama() {
        for (name, bytes, expected) in [
            ("a.hdr", radiance_file("-Y 4 +X 32"), "2:1"),
            ("b.hdr", radiance_file("-Y 60000 +X 60000"), "60000"),
            ("c.hdr", radiance_file("-Y 4096 +X 8192"), ""),
            ("d.hdr", valid_file()[..200].to_vec(), ""),
            ("e.hdr", b"PNG".to_vec(), ""),
            ("f.hdr", Vec::new(), ""),
        ] {
            let problem = problem_of(name, &bytes);
            assert!(problem.contains(expected), "{name}: {problem}");
        }
        for name in ["g.png", "h"] {
            let error = read(name, &valid_file()).map(|_| ()).unwrap_err();
            assert!(matches!(error, EnvironmentError::UnknownFormat(path) if path.ends_with(name)));
        }
        let mut xyz = valid_file();
        let start = xyz.windows(4).position(|word| word == b"rgbe").unwrap();
        xyz[start..start + 4].copy_from_slice(b"xyze");
        let problem = problem_of("a.hdr", &xyz);
        assert!(problem.contains("xyze"), "{problem}");
        let missing = Path::new("missing/a.hdr");
        let error = Environment::read(missing).unwrap_err();
        assert!(matches!(error, EnvironmentError::Read { path, .. } if path == missing));
    }
}
