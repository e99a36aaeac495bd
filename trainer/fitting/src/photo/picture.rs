//! Linear pictures of cameras.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::image::pixel_vec::PixelVec;
use exr::prelude::{ReadChannels, ReadLayers};
use glimpse_materials::untrusted::{escaped, read_at_most};
use tiff::ColorType::{Gray, GrayA, RGB, RGBA};
use tiff::decoder::{DecodingResult, Limits};
use tiff::tags::Tag;

/// The maximum size of a file in bytes.
const MAX_BYTES: u64 = 1 << 31;
/// The maximum number of pixels, which take 1.5 GiB.
const MAX_PIXELS: u64 = 1 << 27;
/// Starts of tone curves of ICC profiles: no points; gamma 1 as a number of 8 + 8 bits; a power of 16 + 16 bits.
const LINEAR_CURVES: [&[u8]; 3] = [
    b"curv\0\0\0\0\0\0\0\0",
    b"curv\0\0\0\0\0\0\0\x01\x01\0",
    b"para\0\0\0\0\0\0\0\0\0\x01\0\0",
];

const REMEDY: &str = "convert the camera's raw file to 16 bits without a gamma curve, for example with `dcraw -4 -T FILE`";

/// A picture whose pixels are proportional to radiance.
#[derive(Clone, Debug)]
pub struct LinearPicture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear RGB as fractions of the sensor's full scale, row by row from the top left. Floats may be negative (noise below
    /// the black level) or above 1.
    pub pixels: Vec<[f32; 3]>,
}

/// An error in reading a picture.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}; {REMEDY}", path.display())]
pub struct PictureFileError {
    /// The file.
    pub path: PathBuf,
    /// The problem.
    pub problem: PictureProblem,
}

/// A problem of a picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureProblem {
    /// The operating system cannot read the file.
    #[error("cannot read the file: {0}")]
    Read(#[from] io::Error),
    /// The file has another format, or its decoder refuses it.
    #[error("it cannot be decoded as PNG, TIFF or OpenEXR: {0}")]
    Damaged(String),
    /// Channels are integers with a number of bits other than 16.
    #[error("it has {0} bits per channel, which cameras write with a gamma curve")]
    Bits(u8),
    /// The ICC profile, or else the sRGB or gAMA chunk, has a tone curve.
    #[error("its ICC profile, sRGB chunk or gAMA chunk states a gamma curve")]
    ToneCurve,
    /// The product of width and height is above 134,217,728.
    #[error("it has {0} x {1} pixels, but at most {MAX_PIXELS} are valid; crop it")]
    Size(u32, u32),
    /// A value is infinite or not a number: the column and row, from 0 at the top left.
    #[error("the pixel at column {0}, row {1} is not finite")]
    NotFinite(usize, usize),
}

impl LinearPicture {
    /// Reads a PNG file of 16 bits, a TIFF file of 16 bits or floats, or an OpenEXR file with channels R, G and B.
    ///
    /// A gray picture has equal channels. Alpha is ignored, because pixels off the ball are not used. A file that does not state
    /// a tone curve is linear, as converters of raw files write it.
    ///
    /// # Errors
    /// If the file cannot be read or decoded, is too large, or states that its values are not linear.
    pub fn read(path: &Path) -> Result<Self, PictureFileError> {
        let bytes = read_at_most(path, MAX_BYTES).map_err(PictureProblem::from);
        let picture = bytes.and_then(|bytes| Self::decode(&bytes));
        let path = path.into();
        picture.map_err(|problem| PictureFileError { path, problem })
    }

    /// Decodes the content of a file, as [`read`](Self::read).
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn decode(bytes: &[u8]) -> Result<Self, PictureProblem> {
        let file = Cursor::new(bytes);
        let picture = match bytes {
            [0x89, b'P', ..] => decode_png(file),
            [b'I', b'I', ..] | [b'M', b'M', ..] => decode_tiff(file),
            _ => decode_exr(file),
        }?;
        let not_finite = |pixel: &[f32; 3]| !pixel.iter().all(|value| value.is_finite());
        let (width, place) = (picture.width, picture.pixels.iter().position(not_finite));
        place.map_or(Ok(picture), |place| {
            Err(PictureProblem::NotFinite(place % width, place / width))
        })
    }

    /// Creates a picture from the samples of pixels: gray or RGB, then alpha.
    fn new((width, height): (u32, u32), channels: usize, samples: &[f32]) -> Self {
        let rgb = if channels < 3 { [0; 3] } else { [0, 1, 2] };
        let pixels = samples.chunks_exact(channels);
        Self {
            width: width as usize,
            height: height as usize,
            pixels: pixels.map(|pixel| rgb.map(|index| pixel[index])).collect(),
        }
    }
}

fn decode_png(file: Cursor<&[u8]>) -> Result<LinearPicture, PictureProblem> {
    let mut reader = png::Decoder::new(file).read_info().map_err(damaged)?;
    let info = reader.info();
    let (size, channels) = ((info.width, info.height), info.color_type.samples());
    // sRGB has a gamma, too.
    let gamma = info.gamma().map_or(1.0, |gamma| gamma.into_value());
    let profile = info.icc_profile.as_ref();
    let is_linear = profile.map_or(gamma == 1.0, |profile| is_linear(profile));
    check(size, info.bit_depth as u8, is_linear)?;
    let mut bytes = vec![0; reader.output_buffer_size().unwrap_or_default()];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    let samples = bytes.as_chunks().0.iter();
    let samples: Vec<f32> = samples
        .map(|bytes| fraction(u16::from_be_bytes(*bytes)))
        .collect();
    Ok(LinearPicture::new(size, channels, &samples))
}

fn decode_tiff(file: Cursor<&[u8]>) -> Result<LinearPicture, PictureProblem> {
    let mut decoder = tiff::decoder::Decoder::new(file).map_err(damaged)?;
    let (size, color) = (decoder.dimensions(), decoder.colortype().map_err(damaged)?);
    let (size, channels) = (size.map_err(damaged)?, usize::from(color.num_samples()));
    let profile = decoder.find_tag(Tag::IccProfile).map_err(damaged)?;
    let is_linear = profile.is_none_or(|tag| tag.into_u8_vec().is_ok_and(|tag| is_linear(&tag)));
    check(size, color.bit_depth(), is_linear)?;
    let image = decoder.with_limits(Limits::unlimited()).read_image();
    let samples: Vec<f32> = match image.map_err(damaged)? {
        DecodingResult::U16(samples) => samples.into_iter().map(fraction).collect(),
        DecodingResult::F16(samples) => samples.into_iter().map(f32::from).collect(),
        DecodingResult::F32(samples) => samples,
        _ => return Err(PictureProblem::Bits(color.bit_depth())),
    };
    let is_rgb = matches!(color, Gray(_) | GrayA(_) | RGB(_) | RGBA(_));
    // Only the first plane is read.
    if !is_rgb || samples.len() as u64 != channels as u64 * u64::from(size.0) * u64::from(size.1) {
        return Err(damaged("its colors are not RGB side by side"));
    }
    Ok(LinearPicture::new(size, channels, &samples))
}

fn decode_exr(file: Cursor<&[u8]>) -> Result<LinearPicture, PictureProblem> {
    let chunks = exr::block::read(file, false).map_err(damaged)?;
    for size in chunks.headers().iter().map(|layer| layer.layer_size) {
        check((size.0 as u32, size.1 as u32), 16, true)?;
    }
    let reader = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level();
    let create = PixelVec::<(f32, f32, f32)>::constructor;
    let reader = reader
        .rgb_channels(create, PixelVec::set_pixel)
        .first_valid_layer();
    let image = reader
        .all_attributes()
        .from_chunks(chunks)
        .map_err(damaged)?;
    let PixelVec { resolution, pixels } = image.layer_data.channel_data.pixels;
    Ok(LinearPicture {
        width: resolution.0,
        height: resolution.1,
        pixels: pixels.into_iter().map(<[f32; 3]>::from).collect(),
    })
}

/// Checks what the start of a file states.
fn check(size: (u32, u32), bits: u8, is_linear: bool) -> Result<(), PictureProblem> {
    match u64::from(size.0) * u64::from(size.1) {
        _ if bits < 16 => Err(PictureProblem::Bits(bits)),
        _ if !is_linear => Err(PictureProblem::ToneCurve),
        0..=MAX_PIXELS => Ok(()),
        _ => Err(PictureProblem::Size(size.0, size.1)),
    }
}

/// Returns true if an ICC profile has tone curves, and all have gamma 1. Tables of colors are not read.
fn is_linear(profile: &[u8]) -> bool {
    let tags = profile.get(132..).unwrap_or_default().as_chunks::<12>().0;
    let curves = tags.iter().filter(|tag| tag[1..4] == *b"TRC").map(|tag| {
        let start = u32::from_be_bytes([tag[4], tag[5], tag[6], tag[7]]) as usize;
        profile.get(start..).unwrap_or_default()
    });
    let is_linear = |curve: &[u8]| LINEAR_CURVES.iter().any(|start| curve.starts_with(start));
    curves.clone().count() > 0 && curves.clone().all(is_linear)
}

fn damaged(error: impl ToString) -> PictureProblem {
    PictureProblem::Damaged(escaped(&error.to_string()))
}

fn fraction(sample: u16) -> f32 {
    f32::from(sample) / f32::from(u16::MAX)
}

#[cfg(test)]
mod tests {
    use PictureProblem::{Bits, Damaged, NotFinite, Size, ToneCurve};
    use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
    use png::{BitDepth, chunk, chunk::ChunkType};
    use tiff::encoder::{TiffEncoder, TiffValue, colortype};

    use super::*;

    const SAMPLES: [u16; 6] = [0, 1, 32768, 65535, 257, 4660];

    fn png(depth: BitDepth, kind: ChunkType, data: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(kind, data).unwrap();
        let samples = SAMPLES.map(u16::to_be_bytes).concat();
        writer
            .write_image_data(&samples[..6 * depth as usize / 8])
            .unwrap();
        drop(writer);
        file
    }

    fn tiff<C: colortype::ColorType>(samples: &[C::Inner], curve: &[u8]) -> Vec<u8>
    where
        [C::Inner]: TiffValue,
    {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut image = encoder.new_image::<C>(2, 1).unwrap();
        let profile = [&[0; 132], &b"rTRC\0\0\0\x90\0\0\0\x10"[..], curve].concat();
        image
            .encoder()
            .write_tag(Tag::IccProfile, &profile[..])
            .unwrap();
        image.write_data(samples).unwrap();
        file.into_inner()
    }

    #[test]
    fn formats_have_the_same_pixels() {
        let floats = SAMPLES.map(fraction);
        let pixels = floats.as_chunks::<3>().0;
        let mut exr = Cursor::new(Vec::new());
        let channels =
            SpecificChannels::rgb(|at: Vec2<usize>| <(f32, f32, f32)>::from(pixels[at.0]));
        let image = Image::from_channels((2, 1), channels);
        image.write().to_buffered(&mut exr).unwrap();
        let files = [
            exr.into_inner(),
            png(BitDepth::Sixteen, chunk::gAMA, &100_000_u32.to_be_bytes()),
            tiff::<colortype::RGB16>(&SAMPLES, LINEAR_CURVES[0]),
            tiff::<colortype::RGB32Float>(&floats, LINEAR_CURVES[1]),
        ];
        for file in files {
            assert_eq!(LinearPicture::decode(&file).unwrap().pixels, pixels);
            LinearPicture::decode(&file[..file.len() / 2]).unwrap_err();
        }
        let gray = tiff::<colortype::Gray16>(&SAMPLES[2..4], LINEAR_CURVES[2]);
        let gray = LinearPicture::decode(&gray).unwrap();
        assert_eq!(gray.pixels, [[floats[2]; 3], [1.0; 3]]);
    }

    #[test]
    fn other_pictures_are_refused() {
        let problem = |file: &[u8]| LinearPicture::decode(file).unwrap_err();
        let gamma = 45_455_u32.to_be_bytes();
        assert!(matches!(
            problem(&png(BitDepth::Eight, chunk::gAMA, &gamma)),
            Bits(8)
        ));
        assert!(matches!(
            problem(&png(BitDepth::Sixteen, chunk::gAMA, &gamma)),
            ToneCurve
        ));
        assert!(matches!(
            problem(&png(BitDepth::Sixteen, chunk::sRGB, &[0])),
            ToneCurve
        ));
        let file = tiff::<colortype::RGB16>(&SAMPLES, b"curv\0\0\0\0\0\0\0\x01\x02\x33");
        assert!(matches!(problem(&file), ToneCurve));
        let infinite = [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 0.0];
        let file = tiff::<colortype::RGB32Float>(&infinite, LINEAR_CURVES[0]);
        assert!(matches!(problem(&file), NotFinite(1, 0)));
        assert!(matches!(problem(b"GIF89a"), Damaged(_)));
        assert!(matches!(check((1 << 14, 1 << 14), 16, true), Err(Size(..))));
    }
}
