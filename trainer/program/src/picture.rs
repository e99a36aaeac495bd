//! Files of linear pictures of cameras.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::image::pixel_vec::PixelVec;
use exr::prelude::{ReadChannels, ReadLayers, Vec2};
use glimpse_fitting::photo::LinearPicture;
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

/// Width and height.
type Sides = (usize, usize);
/// The size, the number of channels, and their values pixel by pixel.
type Decoded = Result<(Sides, usize, Vec<f32>), PictureProblem>;

/// Reads a PNG file of 16 bits, a TIFF file of 16 bits or floats, or an OpenEXR file with channels R, G and B.
///
/// A gray picture has equal channels. Alpha is ignored, because pixels off the ball are not used. A file that does not state
/// a tone curve is linear, as converters of raw files write it.
///
/// # Errors
/// If the file cannot be read or decoded, is too large, or states that its values are not linear.
pub fn read(path: &Path) -> Result<LinearPicture, PictureFileError> {
    read_with(path, decode)
}

/// Reads a PNG file of any kind as a mask: 1 where it is brighter than half of full scale, otherwise 0.
///
/// # Errors
/// If the file cannot be read or decoded, or is too large.
pub(crate) fn read_mask(path: &Path) -> Result<LinearPicture, PictureFileError> {
    read_with(path, |bytes| checked(decode_mask(Cursor::new(bytes))?))
}

fn read_with(
    path: &Path,
    decode: impl Fn(&[u8]) -> Result<LinearPicture, PictureProblem>,
) -> Result<LinearPicture, PictureFileError> {
    let bytes = read_at_most(path, MAX_BYTES).map_err(PictureProblem::from);
    let picture = bytes.and_then(|bytes| decode(&bytes));
    let path = path.into();
    picture.map_err(|problem| PictureFileError { path, problem })
}

/// Decodes the content of a file, as [`read`].
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8]) -> Result<LinearPicture, PictureProblem> {
    checked(match bytes {
        [0x89, b'P', ..] => decode_png(Cursor::new(bytes)),
        [b'I', b'I', ..] | [b'M', b'M', ..] => decode_tiff(Cursor::new(bytes)),
        _ => decode_exr(Cursor::new(bytes)),
    }?)
}

fn checked(
    ((width, height), channels, samples): (Sides, usize, Vec<f32>),
) -> Result<LinearPicture, PictureProblem> {
    if samples.len() != width * height * channels {
        return Err(damaged("its channels are in separate planes"));
    }
    if let Some(index) = samples.iter().position(|sample| !sample.is_finite()) {
        let pixel = index / channels;
        return Err(PictureProblem::NotFinite(pixel % width, pixel / width));
    }
    let places = if channels < 3 { [0; 3] } else { [0, 1, 2] };
    let pixels = samples.chunks_exact(channels);
    let pixels = pixels.map(|pixel| places.map(|place| pixel[place]));
    Ok(LinearPicture {
        width,
        height,
        pixels: pixels.collect(),
    })
}

fn decode_png(file: Cursor<&[u8]>) -> Decoded {
    let mut reader = png::Decoder::new(file).read_info().map_err(damaged)?;
    let info = reader.info();
    // sRGB has a gamma, too.
    let gamma = info.gamma().map_or(1.0, png::ScaledFloat::into_value);
    let profile = info.icc_profile.as_ref();
    let is_linear = profile.map_or(gamma == 1.0, |profile| is_linear(profile));
    let size = check(info.size(), info.bit_depth as u8, is_linear)?;
    let channels = info.color_type.samples();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap_or_default()];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    let samples = bytes.as_chunks().0.iter();
    let samples = samples.map(|bytes| fraction(u16::from_be_bytes(*bytes)));
    Ok((size, channels, samples.collect()))
}

fn decode_mask(file: Cursor<&[u8]>) -> Decoded {
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size = check(reader.info().size(), 16, true)?;
    let channels = reader.output_color_type().0.samples();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap_or_default()];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    let samples = bytes.iter().map(|byte| f32::from(byte >> 7));
    Ok((size, channels, samples.collect()))
}

fn decode_tiff(file: Cursor<&[u8]>) -> Decoded {
    let mut decoder = tiff::decoder::Decoder::new(file).map_err(damaged)?;
    let color = decoder.colortype().map_err(damaged)?;
    let profile = decoder.find_tag(Tag::IccProfile).map_err(damaged)?;
    let is_linear = profile.is_none_or(|tag| tag.into_u8_vec().is_ok_and(|tag| is_linear(&tag)));
    let size = decoder.dimensions().map_err(damaged)?;
    let size = check(size, color.bit_depth(), is_linear)?;
    let (Gray(_) | GrayA(_) | RGB(_) | RGBA(_)) = color else {
        return Err(damaged("its colors are neither gray nor RGB"));
    };
    let image = decoder.with_limits(Limits::unlimited()).read_image();
    let samples = match image.map_err(damaged)? {
        DecodingResult::U16(samples) => samples.into_iter().map(fraction).collect(),
        DecodingResult::F16(samples) => samples.into_iter().map(f32::from).collect(),
        DecodingResult::F32(samples) => samples,
        _ => return Err(PictureProblem::Bits(color.bit_depth())),
    };
    Ok((size, color.num_samples().into(), samples))
}

fn decode_exr(file: Cursor<&[u8]>) -> Decoded {
    let chunks = exr::block::read(file, false).map_err(damaged)?;
    for Vec2(width, height) in chunks.headers().iter().map(|layer| layer.layer_size) {
        check((width as u32, height as u32), 16, true)?;
    }
    let create = PixelVec::<(f32, f32, f32)>::constructor;
    let samples = exr::prelude::read().no_deep_data();
    let channels = samples.largest_resolution_level();
    let layers = channels.rgb_channels(create, PixelVec::set_pixel);
    let attributes = layers.first_valid_layer().all_attributes();
    let image = attributes.from_chunks(chunks).map_err(damaged)?;
    let PixelVec { resolution, pixels } = image.layer_data.channel_data.pixels;
    let samples = pixels.into_iter().flat_map(<[f32; 3]>::from);
    Ok(((resolution.0, resolution.1), 3, samples.collect()))
}

/// Returns the size that the start of a file states, if the values are linear and not too many.
fn check(size: (u32, u32), bits: u8, is_linear: bool) -> Result<Sides, PictureProblem> {
    match u64::from(size.0) * u64::from(size.1) {
        _ if bits < 16 => Err(PictureProblem::Bits(bits)),
        _ if !is_linear => Err(PictureProblem::ToneCurve),
        0..=MAX_PIXELS => Ok((size.0 as usize, size.1 as usize)),
        _ => Err(PictureProblem::Size(size.0, size.1)),
    }
}

/// Returns true if an ICC profile has tone curves, and all have gamma 1. Tables of colors are not read.
fn is_linear(profile: &[u8]) -> bool {
    let tags = profile.get(132..).unwrap_or_default().as_chunks::<12>().0;
    let mut curves = tags.iter().filter(|tag| tag[1..4] == *b"TRC").peekable();
    let is_linear = |tag: &[u8; 12]| {
        let start = u32::from_be_bytes([tag[4], tag[5], tag[6], tag[7]]) as usize;
        let curve = profile.get(start..).unwrap_or_default();
        LINEAR_CURVES.iter().any(|linear| curve.starts_with(linear))
    };
    curves.peek().is_some() && curves.all(is_linear)
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
    use exr::prelude::{Image, SpecificChannels, WritableImage};
    use png::{BitDepth, chunk, chunk::ChunkType};
    use tiff::encoder::colortype::{ColorType, Gray16, RGB16, RGB32Float};
    use tiff::encoder::{TiffEncoder, TiffValue};

    use super::*;

    const SAMPLES: [u16; 6] = [0, 1, 32768, 65535, 257, 4660];

    fn png(depth: BitDepth, kind: ChunkType, data: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 2, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(kind, data).unwrap();
        let samples = &SAMPLES.map(u16::to_be_bytes).concat()[..6 * depth as usize / 8];
        writer.write_image_data(samples).unwrap();
        drop(writer);
        file
    }

    fn tiff<C: ColorType>(samples: &[C::Inner], curve: &[u8]) -> Vec<u8>
    where
        [C::Inner]: TiffValue,
    {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut image = encoder.new_image::<C>(2, 1).unwrap();
        let profile = [&[0; 132], &b"rTRC\0\0\0\x90\0\0\0\x10"[..], curve].concat();
        let state = image.encoder().write_tag(Tag::IccProfile, &profile[..]);
        state.and_then(|()| image.write_data(samples)).unwrap();
        file.into_inner()
    }

    #[test]
    fn formats_have_the_same_pixels() {
        let floats = SAMPLES.map(fraction);
        let pixels = floats.as_chunks::<3>().0;
        let mut exr = Cursor::new(Vec::new());
        let color = |at: Vec2<usize>| <(f32, f32, f32)>::from(pixels[at.0]);
        let image = Image::from_channels((2, 1), SpecificChannels::rgb(color));
        image.write().to_buffered(&mut exr).unwrap();
        for file in [
            exr.into_inner(),
            png(BitDepth::Sixteen, chunk::gAMA, &100_000_u32.to_be_bytes()),
            tiff::<RGB16>(&SAMPLES, LINEAR_CURVES[0]),
            tiff::<RGB32Float>(&floats, LINEAR_CURVES[1]),
        ] {
            assert_eq!(decode(&file).unwrap().pixels, pixels);
            decode(&file[..file.len() / 2]).unwrap_err();
        }
        let gray = decode(&tiff::<Gray16>(&SAMPLES[2..4], LINEAR_CURVES[2]));
        assert_eq!(gray.unwrap().pixels, [[floats[2]; 3], [1.0; 3]]);
    }

    #[test]
    fn other_pictures_are_refused() {
        let gamma = 45_455_u32.to_be_bytes();
        let infinite = [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 0.0];
        for (file, problem) in [
            (png(BitDepth::Eight, chunk::gAMA, &gamma), Bits(8)),
            (png(BitDepth::Sixteen, chunk::gAMA, &gamma), ToneCurve),
            (png(BitDepth::Sixteen, chunk::sRGB, &[0]), ToneCurve),
            (
                tiff::<RGB16>(&SAMPLES, b"curv\0\0\0\0\0\0\0\x01\x02\x33"),
                ToneCurve,
            ),
            (
                tiff::<RGB32Float>(&infinite, LINEAR_CURVES[0]),
                NotFinite(1, 0),
            ),
        ] {
            let found = decode(&file).unwrap_err();
            assert_eq!(found.to_string(), problem.to_string());
        }
        assert!(matches!(decode(b"GIF89a"), Err(Damaged(_))));
        assert!(matches!(check((1 << 14, 1 << 14), 16, true), Err(Size(..))));
    }
}
