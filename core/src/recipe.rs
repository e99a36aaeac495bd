//! The recipe: all that the trainer hands to the device.
//!
//! [`Recipe::parse`] checks everything; a `Recipe` that exists cannot fail. It borrows the bytes
//! (in flash) and copies nothing.
//!
//! # Format, version 1
//!
//! | bytes | content |
//! |---|---|
//! | 0..4 | magic `GLMP` |
//! | 4..6 | format version, little-endian u16 |
//! | 6..10 | length of the body in bytes, little-endian u32 |
//! | 10..14 | CRC-32 (ISO-HDLC) of bytes 4..10 and the body, little-endian u32 |
//! | 14.. | body: postcard of the private struct `Body`, in this order |
//!
//! | field | postcard type | content |
//! |---|---|---|
//! | model | enum | [`ModelKind`] |
//! | inner_steps | u16 | SGD steps, 1 to [`MAX_INNER_STEPS`] |
//! | pattern | bytes | n x (theta_h, theta_d, phi_d), packed little-endian f32, radians |
//! | initial | bytes | initial parameters, packed f32, in the model's order |
//! | step_sizes | bytes | a step size for each parameter, packed f32 |
//! | expected_loss | f32 | the trainer's loss on materials held out from training |
//! | provenance | [`Provenance`] | where it came from |
//!
//! A version never changes once released: a reader refuses versions it does not know by
//! [`RecipeError::Version`].

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::{Deserialize, Serialize};

use crate::angles::{Angles, HalfDifference};
use crate::model::ModelKind;

/// The first bytes of every recipe.
pub const MAGIC: [u8; 4] = *b"GLMP";
/// The format version that this crate reads and writes.
pub const VERSION: u16 = 1;
/// Bytes before the body.
pub const HEADER_BYTES: usize = 14;
/// The largest number of samples in a pattern.
pub const MAX_SAMPLES: usize = 4096;
/// The largest number of inner steps.
pub const MAX_INNER_STEPS: u16 = 10_000;

const CHECKSUM: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// A field of the recipe, to name it in errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Field {
    /// The body as a whole.
    Body,
    /// SGD steps.
    InnerSteps,
    /// Where to measure.
    Pattern,
    /// Initial parameters.
    Initial,
    /// A step size for each parameter.
    StepSizes,
    /// The loss to expect.
    ExpectedLoss,
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Body => "body",
            Self::InnerSteps => "inner_steps",
            Self::Pattern => "pattern",
            Self::Initial => "initial",
            Self::StepSizes => "step_sizes",
            Self::ExpectedLoss => "expected_loss",
        })
    }
}

/// Why bytes are not a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecipeError {
    /// The first four bytes are not `GLMP`.
    Magic,
    /// A format version that this crate does not read.
    Version(u16),
    /// The header promises more or fewer bytes than there are.
    Length {
        /// Bytes of header and body together, by the header.
        expected: u32,
        /// Bytes at hand.
        found: u32,
    },
    /// The bytes were altered after they were written.
    Checksum,
    /// The body does not follow the format, although its checksum is right.
    Malformed,
    /// A field has an impossible number of entries, or an impossible count.
    Count(Field),
    /// A field holds a NaN or an infinity.
    NonFinite(Field),
    /// A direction of the pattern's sample with this index is below the horizon.
    BelowHorizon(u16),
    /// The buffer given to [`Recipe::write`] is too small.
    BufferTooSmall,
}

impl core::fmt::Display for RecipeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Magic => f.write_str("this is not a recipe: it does not begin with GLMP"),
            Self::Version(version) => {
                write!(
                    f,
                    "recipe format {version} is unknown: this reads format {VERSION}"
                )
            }
            Self::Length { expected, found } => {
                write!(
                    f,
                    "the recipe should have {expected} bytes but has {found}: it was cut or padded"
                )
            }
            Self::Checksum => f.write_str("the recipe's checksum is wrong: its bytes were altered"),
            Self::Malformed => f.write_str("the recipe's body does not follow the format"),
            Self::Count(field) => write!(f, "the recipe's field `{field}` has an impossible count"),
            Self::NonFinite(field) => {
                write!(f, "the recipe's field `{field}` holds a NaN or an infinity")
            }
            Self::BelowHorizon(index) => {
                write!(
                    f,
                    "sample {index} of the recipe's pattern has a direction below the horizon"
                )
            }
            Self::BufferTooSmall => f.write_str("the buffer is too small for the recipe"),
        }
    }
}

impl core::error::Error for RecipeError {}

/// A list of f32, packed as little-endian bytes, read in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Floats<'a>(&'a [[u8; 4]]);

impl<'a> Floats<'a> {
    /// None if the length is not a multiple of four.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        match bytes.as_chunks() {
            (words, []) => Some(Self(words)),
            _ => None,
        }
    }

    /// How many numbers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True if there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The numbers, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + Clone + 'a {
        self.0.iter().map(|word| f32::from_le_bytes(*word))
    }
}

/// Where a recipe came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance<'a> {
    /// The program that trained it, with its version.
    pub trainer: &'a str,
    /// The materials it was trained on.
    pub data: &'a str,
    /// How many materials those were.
    pub materials: u32,
    /// Schedule and effort.
    pub schedule: &'a str,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// What is written; see the file's head.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Body<'a> {
    model: ModelKind,
    inner_steps: u16,
    pattern: &'a [u8],
    initial: &'a [u8],
    step_sizes: &'a [u8],
    expected_loss: f32,
    #[serde(borrow)]
    provenance: Provenance<'a>,
}

/// A recipe in memory or in flash, checked.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    model: ModelKind,
    inner_steps: u16,
    pattern: &'a [[u8; 12]],
    initial: Floats<'a>,
    step_sizes: Floats<'a>,
    expected_loss: f32,
    provenance: Provenance<'a>,
    checksum: u32,
}

/// The ingredients of a recipe, for [`Recipe::write`].
#[derive(Clone, Copy, Debug)]
pub struct Ingredients<'a> {
    /// The model.
    pub model: ModelKind,
    /// SGD steps.
    pub inner_steps: u16,
    /// n x (theta_h, theta_d, phi_d), packed little-endian f32, radians.
    pub pattern: &'a [u8],
    /// Initial parameters, packed little-endian f32.
    pub initial: &'a [u8],
    /// A step size for each parameter, packed little-endian f32.
    pub step_sizes: &'a [u8],
    /// The loss to expect on a material that training never saw.
    pub expected_loss: f32,
    /// Where it came from.
    pub provenance: Provenance<'a>,
}

impl<'a> Recipe<'a> {
    /// Reads a recipe in place.
    ///
    /// # Errors
    /// What is wrong with the bytes, by name. After `Ok` nothing about the recipe can fail.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, RecipeError> {
        let (magic, rest) = bytes.split_first_chunk().ok_or(RecipeError::Magic)?;
        if *magic != MAGIC {
            return Err(RecipeError::Magic);
        }
        let short = |expected| RecipeError::Length {
            expected,
            found: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
        };
        let header = short(HEADER_BYTES as u32);
        let (version, after_version) = rest.split_first_chunk().ok_or(header)?;
        let (length, after_length) = after_version.split_first_chunk().ok_or(header)?;
        let (checksum, body) = after_length.split_first_chunk().ok_or(header)?;
        let version = u16::from_le_bytes(*version);
        if version != VERSION {
            return Err(RecipeError::Version(version));
        }
        let expected = u32::from_le_bytes(*length);
        if u32::try_from(body.len()) != Ok(expected) {
            return Err(short(expected.saturating_add(HEADER_BYTES as u32)));
        }
        let checksum = u32::from_le_bytes(*checksum);
        if checksum != checksum_of(version, expected, body) {
            return Err(RecipeError::Checksum);
        }
        match postcard::take_from_bytes::<Body<'a>>(body) {
            Ok((body, [])) => Self::check(body, checksum),
            _ => Err(RecipeError::Malformed),
        }
    }

    fn check(body: Body<'a>, checksum: u32) -> Result<Self, RecipeError> {
        if !(1..=MAX_INNER_STEPS).contains(&body.inner_steps) {
            return Err(RecipeError::Count(Field::InnerSteps));
        }
        let (pattern, []) = body.pattern.as_chunks() else {
            return Err(RecipeError::Count(Field::Pattern));
        };
        if !(1..=MAX_SAMPLES).contains(&pattern.len()) {
            return Err(RecipeError::Count(Field::Pattern));
        }
        let parameters = body.model.parameters();
        let list = |bytes, field| {
            let list = Floats::new(bytes)
                .filter(|list| list.len() == parameters)
                .ok_or(RecipeError::Count(field))?;
            if list.iter().all(f32::is_finite) {
                Ok(list)
            } else {
                Err(RecipeError::NonFinite(field))
            }
        };
        let recipe = Self {
            model: body.model,
            inner_steps: body.inner_steps,
            pattern,
            initial: list(body.initial, Field::Initial)?,
            step_sizes: list(body.step_sizes, Field::StepSizes)?,
            expected_loss: body.expected_loss,
            provenance: body.provenance,
            checksum,
        };
        if !body.expected_loss.is_finite() {
            return Err(RecipeError::NonFinite(Field::ExpectedLoss));
        }
        for (index, angles) in recipe.pattern().enumerate() {
            let Angles {
                theta_h,
                theta_d,
                phi_d,
            } = angles;
            if !(theta_h.is_finite() && theta_d.is_finite() && phi_d.is_finite()) {
                return Err(RecipeError::NonFinite(Field::Pattern));
            }
            if !HalfDifference::from_angles(angles).is_valid() {
                return Err(RecipeError::BelowHorizon(index as u16));
            }
        }
        Ok(recipe)
    }

    /// Writes a recipe into `buffer` and returns the bytes used.
    ///
    /// # Errors
    /// [`RecipeError::BufferTooSmall`], or what [`Recipe::parse`] would refuse.
    pub fn write<'b>(
        ingredients: &Ingredients<'_>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], RecipeError> {
        let body = Body {
            model: ingredients.model,
            inner_steps: ingredients.inner_steps,
            pattern: ingredients.pattern,
            initial: ingredients.initial,
            step_sizes: ingredients.step_sizes,
            expected_loss: ingredients.expected_loss,
            provenance: ingredients.provenance,
        };
        let (header, rest) = buffer
            .split_first_chunk_mut::<HEADER_BYTES>()
            .ok_or(RecipeError::BufferTooSmall)?;
        let written = postcard::to_slice(&body, rest).map_err(|_| RecipeError::BufferTooSmall)?;
        let length = u32::try_from(written.len()).map_err(|_| RecipeError::Count(Field::Body))?;
        let checksum = checksum_of(VERSION, length, written);
        let fields = MAGIC
            .into_iter()
            .chain(VERSION.to_le_bytes())
            .chain(length.to_le_bytes())
            .chain(checksum.to_le_bytes());
        for (byte, value) in header.iter_mut().zip(fields) {
            *byte = value;
        }
        let total = HEADER_BYTES + written.len();
        let bytes = buffer.get(..total).ok_or(RecipeError::BufferTooSmall)?;
        Recipe::parse(bytes)?;
        Ok(bytes)
    }

    /// The model that it fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.pattern.len()
    }

    /// SGD steps of the fit.
    #[must_use]
    pub fn inner_steps(&self) -> u16 {
        self.inner_steps
    }

    /// Where to measure, in radians; both directions of each are above the horizon.
    pub fn pattern(&self) -> impl ExactSizeIterator<Item = Angles<f32>> + Clone + 'a {
        self.pattern.iter().map(|bytes| {
            let [a, b, c, d, e, f, g, h, i, j, k, l] = *bytes;
            Angles {
                theta_h: f32::from_le_bytes([a, b, c, d]),
                theta_d: f32::from_le_bytes([e, f, g, h]),
                phi_d: f32::from_le_bytes([i, j, k, l]),
            }
        })
    }

    /// Initial parameters, in the model's order.
    #[must_use]
    pub fn initial(&self) -> Floats<'a> {
        self.initial
    }

    /// A step size for each parameter, in the same order.
    #[must_use]
    pub fn step_sizes(&self) -> Floats<'a> {
        self.step_sizes
    }

    /// The loss to expect on a material that training never saw.
    #[must_use]
    pub fn expected_loss(&self) -> f32 {
        self.expected_loss
    }

    /// Where it came from.
    #[must_use]
    pub fn provenance(&self) -> &Provenance<'a> {
        &self.provenance
    }

    /// The CRC-32 in its header: names the recipe on the link.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}

fn checksum_of(version: u16, length: u32, body: &[u8]) -> u32 {
    let mut digest = CHECKSUM.digest();
    digest.update(&version.to_le_bytes());
    digest.update(&length.to_le_bytes());
    digest.update(body);
    digest.finalize()
}
