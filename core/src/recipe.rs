//! The recipe: all that the trainer hands to the device.
//!
//! [`Recipe::parse`] checks everything; a `Recipe` that exists cannot fail. It borrows the bytes
//! (in flash) and copies nothing.
//!
//! # Format
//!
//! | bytes | content |
//! |---|---|
//! | 0..4 | magic `GLMP` |
//! | 4..6 | format version, little-endian u16 |
//! | 6..10 | length of the body in bytes, little-endian u32 |
//! | 10..14 | CRC-32 (ISO-HDLC) of bytes 4..10 and the body, little-endian u32 |
//! | 14.. | body, by postcard; a list is postcard `bytes` of packed little-endian f32 |
//!
//! The body of version 2, [`Ingredients`]:
//!
//! | field | postcard type | content |
//! |---|---|---|
//! | pattern | bytes | n x (theta_h, theta_d, phi_d), radians; n is 1 to [`MAX_SAMPLES`] |
//! | learner | enum | 0: a descent, 1: a ridge solve; then its fields |
//! | expected_loss | f32 | the trainer's loss on materials held out from training |
//! | provenance | [`Provenance`] | where it came from |
//!
//! A descent, [`PackedDescent`]:
//!
//! | field | postcard type | content |
//! |---|---|---|
//! | model | enum | [`ModelKind`]: 0 Phong, 1 Neural, 2 Cook-Torrance |
//! | inner_steps | u16 | SGD steps, 1 to [`MAX_INNER_STEPS`] |
//! | initial | bytes | initial parameters, in the model's order |
//! | step_sizes | bytes | a step size for each parameter |
//!
//! A ridge solve, [`PackedRidge`], whose model is always Linear and therefore not written:
//!
//! | field | postcard type | content |
//! |---|---|---|
//! | components | u16 | m, 1 to [`MAX_COMPONENTS`] |
//! | basis | bytes | n rows of m: the components at the sampled directions |
//! | mean | bytes | n: the mapped mean there |
//! | median | bytes | n: the median BRDF there, sr^-1 (not times a cosine), none negative |
//! | weight | bytes | n: cos(theta_i) cos(theta_o) there, all positive |
//! | precision | bytes | m: the precision of each coefficient, all positive |
//! | basis_checksum | u32 | CRC-32 of the host's file of the whole basis; 0 for none |
//!
//! The body of version 1, a descent always, is model, inner_steps, pattern, initial, step_sizes,
//! expected_loss, provenance. It is read, and written no more.
//!
//! A version never changes once released: a reader refuses versions it does not know by
//! [`RecipeError::Version`].

mod check;
mod error;
mod format;

pub use crate::fit::{Descent, Learner, Ridge};
pub use crate::numeric::Floats;
pub use error::{Field, RecipeError};
pub use format::{Ingredients, PackedDescent, PackedLearner, PackedRidge, Provenance};

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::geometry::{Angles, HalfDifference};
use crate::model::ModelKind;
use format::FirstBody;

/// The first bytes of every recipe.
pub const MAGIC: [u8; 4] = *b"GLMP";
/// The format version that this crate writes, and the newest that it reads.
pub const VERSION: u16 = 2;
/// The oldest format version that this crate reads.
pub const OLDEST_VERSION: u16 = 1;
/// Bytes before the body.
pub const HEADER_BYTES: usize = 14;
/// The largest number of samples in a pattern.
pub const MAX_SAMPLES: usize = 4096;
/// The largest number of inner steps.
pub const MAX_INNER_STEPS: u16 = 10_000;
/// The largest number of components of a ridge solve.
pub const MAX_COMPONENTS: usize = 1024;

const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// A recipe in memory or in flash, checked.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    pattern: &'a [[u8; 12]],
    learner: Learner<'a>,
    expected_loss: f32,
    provenance: Provenance<'a>,
    checksum: u32,
}

impl<'a> Recipe<'a> {
    /// Reads a recipe in place.
    ///
    /// ```
    /// use glimpse_core::recipe::{Recipe, RecipeError};
    ///
    /// static BYTES: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
    ///
    /// let recipe = Recipe::parse(BYTES)?;
    /// println!("{} of {} samples", recipe.model(), recipe.samples());
    /// for angles in recipe.pattern() {
    ///     println!("theta_h is {} degrees", angles.theta_h.to_degrees());
    /// }
    ///
    /// let error = Recipe::parse(&BYTES[..100]).unwrap_err();
    /// assert_eq!(error.to_string(), "the recipe should have 5577 bytes but has 100: it was cut or padded");
    /// # Ok::<(), RecipeError>(())
    /// ```
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
        if !(OLDEST_VERSION..=VERSION).contains(&version) {
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
        let ingredients = if version == OLDEST_VERSION {
            postcard::take_from_bytes::<FirstBody<'a>>(body).map(|(body, rest)| (body.into(), rest))
        } else {
            postcard::take_from_bytes(body)
        };
        match ingredients {
            Ok((ingredients, [])) => Self::check(&ingredients, checksum),
            _ => Err(RecipeError::Malformed),
        }
    }

    fn check(ingredients: &Ingredients<'a>, checksum: u32) -> Result<Self, RecipeError> {
        let (pattern, []) = ingredients.pattern.as_chunks() else {
            return Err(RecipeError::Count(Field::Pattern));
        };
        if !(1..=MAX_SAMPLES).contains(&pattern.len()) {
            return Err(RecipeError::Count(Field::Pattern));
        }
        let recipe = Self {
            pattern,
            learner: check::check(ingredients.learner, pattern.len())?,
            expected_loss: ingredients.expected_loss,
            provenance: ingredients.provenance,
            checksum,
        };
        if !recipe.expected_loss.is_finite() {
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
        let (header, rest) = buffer
            .split_first_chunk_mut::<HEADER_BYTES>()
            .ok_or(RecipeError::BufferTooSmall)?;
        let written =
            postcard::to_slice(ingredients, rest).map_err(|_| RecipeError::BufferTooSmall)?;
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
        let total = HEADER_BYTES.saturating_add(written.len());
        let bytes = buffer.get(..total).ok_or(RecipeError::BufferTooSmall)?;
        Recipe::parse(bytes)?;
        Ok(bytes)
    }

    /// The model that it fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match &self.learner {
            Learner::Descent(descent) => descent.model(),
            Learner::Ridge(_) => ModelKind::Linear,
        }
    }

    /// How measurements become parameters.
    #[must_use]
    pub fn learner(&self) -> Learner<'a> {
        self.learner
    }

    /// The descent, if that is what it holds.
    #[must_use]
    pub fn descent(&self) -> Option<Descent<'a>> {
        match self.learner {
            Learner::Descent(descent) => Some(descent),
            Learner::Ridge(_) => None,
        }
    }

    /// The ridge solve, if that is what it holds.
    #[must_use]
    pub fn ridge(&self) -> Option<Ridge<'a>> {
        match self.learner {
            Learner::Descent(_) => None,
            Learner::Ridge(ridge) => Some(ridge),
        }
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.pattern.len()
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
