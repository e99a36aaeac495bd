//! Environments from files: panoramas in latitude and longitude, Radiance or OpenEXR.

use std::io::{BufRead, BufReader, Seek};
use std::path::{Path, PathBuf};

use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;
use exr::prelude::{ReadChannels, ReadLayers, Vec2};

use super::{Environment, Image};
use glimpse_materials::untrusted::{escaped, open_at_most};

/// The largest panorama: 8192 x 4096.
const MOST_PIXELS: u64 = 1 << 25;
/// The longest file that is read: 32 bytes for each pixel of the largest panorama, uncompressed.
const MOST_BYTES: u64 = 32 * MOST_PIXELS;
/// No compression of either format packs more into a byte of its file; a header that claims more
/// is not believed.
const MOST_PIXELS_A_BYTE: u64 = 10_000;

/// Why an environment cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The operating system refuses to read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file of no known kind.
    #[error(
        "{} is no environment: give a panorama in latitude and longitude, as Radiance (*.hdr) or \
         OpenEXR (*.exr)", .0.display()
    )]
    Unknown(PathBuf),
    /// A file is not what its name says, or no light can be taken from it.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and the remedy.
        what: String,
    },
}

impl Environment {
    /// Reads a panorama in latitude and longitude: Radiance (`*.hdr`, RGBE) or OpenEXR (`*.exr`,
    /// channels R, G and B of its first layer that has them), linear RGB.
    ///
    /// The panorama is what the viewer sees who turns round at the sphere's place: its center is
    /// straight ahead, behind the sphere; to the right of it is the viewer's right; the left and
    /// right edges meet at the viewer's back; the top row is straight up. Negative radiance, as
    /// conversions of color leave it, counts as black.
    ///
    /// Exposure is chosen: all radiance is scaled so that a white diffuse sphere is, averaged over
    /// what the viewer sees of it, as bright as in the [`studio`](Environment::studio).
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, its sides are not 2:1 or it has more than 2^25
    /// pixels, a pixel is infinite or not a number, or all of it is black.
    pub fn read(path: &Path) -> Result<Self, EnvironmentError> {
        let damaged = |what| EnvironmentError::Damaged {
            path: path.into(),
            what,
        };
        Self::from_panorama(&Image::read_panorama(path)?).map_err(damaged)
    }
}

impl Image {
    /// The panorama of such a file, as it stands there: see [`Environment::read`].
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, or it has more than 2^25 pixels.
    pub fn read_panorama(path: &Path) -> Result<Self, EnvironmentError> {
        let refused = |source| EnvironmentError::Read {
            path: path.into(),
            source,
        };
        let extension = path.extension().and_then(|extension| extension.to_str());
        let decode = match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("hdr" | "pic") => radiance,
            Some("exr") => open_exr,
            _ => return Err(EnvironmentError::Unknown(path.into())),
        };
        let file = open_at_most(path, MOST_BYTES).map_err(refused)?;
        let bytes = file.metadata().map_err(refused)?.len();
        decode(BufReader::new(file), bytes).map_err(|what| EnvironmentError::Damaged {
            path: path.into(),
            what,
        })
    }
}

/// Refuses a size that is too much, or more than so many bytes can hold.
fn check_size(width: u64, height: u64, bytes: u64) -> Result<(), String> {
    let pixels = width.saturating_mul(height);
    if pixels > MOST_PIXELS {
        Err(format!(
            "{width} x {height} pixels are too many: scale it down to 8192 x 4096 or less"
        ))
    } else if pixels > bytes.saturating_mul(MOST_PIXELS_A_BYTE) {
        Err(format!(
            "{width} x {height} pixels cannot be in a file of {bytes} bytes: it is damaged or cut \
             off, fetch it again"
        ))
    } else {
        Ok(())
    }
}

/// A Radiance file. Its EXPOSURE is left aside, because exposure is chosen anew.
fn radiance<R: BufRead + Seek>(mut file: R, bytes: u64) -> Result<Image, String> {
    let damaged = |error: &dyn std::fmt::Display| {
        let error = escaped(&error.to_string());
        format!("not a whole Radiance file (*.hdr): {error}; fetch it or save it again, as RGBE")
    };
    let mut magic = [0; 2];
    let begin = file.read_exact(&mut magic).and_then(|()| file.rewind());
    begin.map_err(|error| damaged(&error))?;
    if &magic != b"#?" {
        return Err(damaged(&"it does not begin with #?"));
    }
    // Strict reading would refuse the common first line #?RGBE.
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

/// An OpenEXR file.
fn open_exr<R: BufRead + Seek>(file: R, bytes: u64) -> Result<Image, String> {
    let damaged = |error: exr::error::Error| {
        format!(
            "not a whole OpenEXR file with channels R, G and B: {}; save it again, with ZIP \
             compression",
            escaped(&error.to_string())
        )
    };
    let reader = exr::block::read(file, false).map_err(damaged)?;
    for header in reader.headers() {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64, bytes)?;
        let window = header.shared_attributes.display_window;
        if (window.position, window.size) != (header.own_attributes.layer_position, size) {
            return Err(
                "its data window is not its display window: save the panorama uncropped".into(),
            );
        }
    }
    let black = |size: Vec2<usize>, _: &_| Image::filled(size.width(), size.height(), [0.0; 3]);
    let set = |image: &mut Image, place: Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        let index = place.y() * image.width + place.x();
        if let Some(pixel) = image.pixels.get_mut(index) {
            *pixel = [r, g, b];
        }
    };
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(black, set)
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)
        .map_err(damaged)?;
    Ok(file.layer_data.channel_data.pixels)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    const WIDTH: usize = 16;
    const HEIGHT: usize = 8;

    /// A Radiance file of one gray, brighter in one pixel, its rows not compressed.
    fn radiance_file(size: &str) -> Vec<u8> {
        let mut file = format!("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
        for index in 0..WIDTH * HEIGHT {
            // By the format's definition: mantissa / 256 x 2^(exponent - 128).
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

    /// The message about a file that is damaged; the file is the one that it names.
    fn damage(name: &str, bytes: &[u8]) -> String {
        match read(name, bytes).map(|_| ()) {
            Err(EnvironmentError::Damaged { path, what }) if path.ends_with(name) => what,
            other => panic!("{name}: {other:?}"),
        }
    }

    fn whole() -> Vec<u8> {
        radiance_file(&format!("-Y {HEIGHT} +X {WIDTH}"))
    }

    #[test]
    fn both_formats_give_the_same_light() {
        let mut panorama = Image::filled(WIDTH, HEIGHT, [0.5, 0.25, 0.125]);
        panorama.pixels[3 * WIDTH + 12] = [16.0, 8.0, 4.0];
        let expected = Environment::from_panorama(&panorama).unwrap();
        let radiance = read("a.hdr", &whole()).unwrap();
        let open_exr = read("a.EXR", &panorama.to_exr().unwrap()).unwrap();
        // Column 12 of 16 is just past a quarter turn to the right of the center, row 3 just above
        // the level.
        let [r, g, b] = expected.radiance([0.962, 0.195, 0.191]);
        assert!(r > 10.0 * expected.radiance([-1.0, 0.0, 0.0])[0]);
        assert!((r / g - 2.0).abs() < 1e-5 && (g / b - 2.0).abs() < 1e-5);
        for direction in [[0.962, 0.195, 0.191], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]] {
            assert_eq!(radiance.radiance(direction), expected.radiance(direction));
            assert_eq!(open_exr.radiance(direction), expected.radiance(direction));
        }
    }

    #[test]
    fn what_is_no_panorama_is_refused_by_its_file() {
        for (name, bytes, named) in [
            ("a.hdr", radiance_file("-Y 4 +X 32"), "2:1"),
            ("b.hdr", radiance_file("-Y 60000 +X 60000"), "60000"),
            ("c.hdr", radiance_file("-Y 4096 +X 8192"), ""),
            ("d.hdr", whole()[..200].to_vec(), ""),
            ("e.hdr", b"PNG".to_vec(), ""),
            ("f.hdr", Vec::new(), ""),
            ("g.exr", whole(), ""),
        ] {
            let what = damage(name, &bytes);
            assert!(what.contains(named), "{name}: {what}");
        }
        for name in ["h.png", "i"] {
            let error = read(name, &whole()).map(|_| ()).unwrap_err();
            assert!(matches!(error, EnvironmentError::Unknown(path) if path.ends_with(name)));
        }
        let mut xyz = whole();
        let at = xyz.windows(4).position(|word| word == b"rgbe").unwrap();
        xyz[at..at + 4].copy_from_slice(b"xyze");
        let what = damage("a.hdr", &xyz);
        assert!(what.contains("xyze"), "{what}");
        let nowhere = Path::new("nowhere/a.hdr");
        let missing = Environment::read(nowhere).unwrap_err();
        assert!(matches!(missing, EnvironmentError::Read { path, .. } if path == nowhere));
    }

    #[test]
    fn damaged_files_are_read_or_refused_but_never_crash() {
        let panorama = Image::filled(WIDTH, HEIGHT, [0.5, 0.25, 0.125]);
        type Decode = fn(Cursor<Vec<u8>>, u64) -> Result<Image, String>;
        for (decode, whole) in [
            (radiance as Decode, whole()),
            (open_exr, panorama.to_exr().unwrap()),
        ] {
            let decode = |bytes: Vec<u8>| {
                let count = bytes.len() as u64;
                decode(Cursor::new(bytes), count)
            };
            assert_eq!(decode(whole.clone()).unwrap().pixels.len(), WIDTH * HEIGHT);
            for length in 0..whole.len() {
                let _ = decode(whole[..length].to_vec());
            }
            // The headers, where sizes are.
            for place in 0..whole.len().min(400) {
                for value in [0, 0x7f, 0xff] {
                    let mut damaged = whole.clone();
                    damaged[place] = value;
                    let _ = decode(damaged);
                }
            }
        }
    }
}
