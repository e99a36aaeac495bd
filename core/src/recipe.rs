//! The recipe: all that the trainer hands to the device.
//!
//! [`Recipe::parse`] checks all that a scan needs; a scan by a `Recipe` that exists cannot fail by
//! it. It borrows the bytes (in flash) and copies nothing but a few numbers. What it states about
//! itself is decoded when it is asked for, by [`Recipe::metadata`].
//!
//! The format is written down in `core/docs/recipe.md`, with an example in bytes: magic, version,
//! length and CRC-32, and then sections, each a [`Kind`] and postcard bytes. What comes later is a
//! new kind; older recipes stay readable.

mod check;
mod contents;
mod decode;
mod error;
mod field;
mod format;
mod header;
mod kind;
mod metadata;
mod parts;
mod sections;
mod size;
mod training;
mod write;

internal! { crate::fit::{Completed, Descent, FitMethod, Ridge} }
internal! { crate::numeric::Floats }
pub use error::RecipeError;
pub use field::Field;
pub use format::{
    HEADER_BYTES, MAGIC, MAX_BASIS, MAX_COMPONENTS, MAX_INNER_STEPS, MAX_MEAN, MAX_MEDIAN,
    MAX_PRECISION, MAX_PREDICTION, MAX_SAMPLES, MAX_WEIGHT, MIN_PRECISION, VERSION,
};
pub use kind::Kind;
pub use metadata::Metadata;
pub use parts::{ExpectedLoss, Noise, Provenance};
internal! { parts::{PackedCoefficientNet, PackedDescent, PackedInitNet} }
internal! { parts::{PackedMethod, PackedRidge, RecipeParts} }
pub use sections::{Materials, Sections};
pub use size::{max_samples, memory_words};
pub use training::{
    Effort, Origin, Parts, Schedule, Training, TrainingSource, TrainingSources, ValidationSplit,
};

use crate::fit::{Algorithm, AnyModel};
use crate::geometry::{Angles, Directions, HalfDifference};
use crate::gonio::{Limits, Unreachable};
use crate::model::{ModelKind, SLOT_WORDS};
use check::PackedAngles;
use contents::Contents;
use header::Sealed;
use write::Writer;

/// A recipe in memory or in flash, checked.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    pattern: &'a [PackedAngles],
    pub(crate) method: FitMethod<'a>,
    sections: Sections<'a>,
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
    /// assert_eq!(error, RecipeError::Length { expected: 5631, found: 100 });
    /// # Ok::<(), RecipeError>(())
    /// ```
    ///
    /// # Errors
    /// What is wrong with the bytes, by name. After `Ok` no scan can fail by the recipe; what it
    /// states about itself is checked by [`Recipe::metadata`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, RecipeError> {
        let Sealed { checksum, body } = header::open(bytes)?;
        let contents = Contents::of_sections(body)?;
        let pattern = check::pattern(contents.pattern)?;
        let method = check::method(contents.method, contents.prediction, pattern.len())?;
        Ok(Self {
            pattern,
            method,
            sections: Sections::new(body),
            checksum,
        })
    }

    /// Writes a recipe of format [`VERSION`] into `buffer` and returns the bytes used.
    ///
    /// # Errors
    /// [`RecipeError::BufferTooSmall`], or what [`Recipe::parse`] or [`Recipe::metadata`] would
    /// refuse.
    #[cfg(feature = "training")]
    pub fn write<'b>(
        parts: &RecipeParts<'_>,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], RecipeError> {
        let mut writer = Writer::new(buffer);
        writer.parts(parts)?;
        let bytes = writer.finish()?;
        let recipe = Recipe::parse(bytes)?;
        recipe.metadata()?;
        // Of other learners it would say nothing. (A reader passes over it.)
        if parts.prediction.is_some() && recipe.completed().is_none() {
            return Err(RecipeError::Missing(Kind::COMPLETION));
        }
        Ok(bytes)
    }

    /// Writes the recipe once more, without sections of these kinds, into `buffer`, and returns the
    /// bytes used. What is left, also of kinds that are unknown here, is the same to the bit; but
    /// the copy has a checksum, and so a name on the link, of its own.
    ///
    /// # Errors
    /// [`RecipeError::Required`] if a kind is not an optional one, or
    /// [`RecipeError::BufferTooSmall`]: the copy takes no more bytes than the recipe.
    pub fn copy_without<'b>(
        &self,
        kinds: &[Kind],
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], RecipeError> {
        if let Some(kind) = kinds.iter().find(|kind| kind.is_required()) {
            return Err(RecipeError::Required(*kind));
        }
        let mut writer = Writer::new(buffer);
        for (kind, bytes) in self.sections() {
            if !kinds.contains(&kind) {
                writer.copy(kind, bytes)?;
            }
        }
        writer.finish()
    }

    /// The model that it fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.method.model()
    }

    /// Number of values of a fit: the model's parameters, or for Linear a coefficient for each component and channel.
    #[must_use]
    pub fn values(&self) -> usize {
        self.method.values()
    }

    /// Returns true if a fit may do without some of the readings: a scan may skip samples then.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.method.tolerates_missing()
    }

    /// The CRC-32 of the host's file of the basis that turns Linear's coefficients into a BRDF; None if there is none.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        self.method.basis_checksum()
    }

    /// The method that fits parameters to readings.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn method(&self) -> FitMethod<'a> {
        self.method
    }

    /// The descent, if that is all that it holds: not where it starts from [completed](Recipe::completed)
    /// readings.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn descent(&self) -> Option<Descent<'a>> {
        match self.method {
            FitMethod::Descent(descent) => Some(descent),
            _ => None,
        }
    }

    /// The ridge solve, if that is what it holds.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn ridge(&self) -> Option<Ridge<'a>> {
        match self.method {
            FitMethod::Ridge(ridge) => Some(ridge),
            _ => None,
        }
    }

    /// The method that completes readings, if it is one.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn completed(&self) -> Option<Completed<'a>> {
        match self.method {
            FitMethod::Completed(completed) => Some(completed),
            _ => None,
        }
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.pattern.len()
    }

    /// Words (of 4 bytes) that a scan takes in memory: [`memory_words`] at run time.
    #[must_use]
    pub fn memory_words(&self) -> usize {
        // Any model is accepted.
        let work = AnyModel::words(&self.method, self.samples()).unwrap_or_default();
        let slots = self.samples().saturating_mul(SLOT_WORDS);
        slots.saturating_add(work)
    }

    /// The directions to measure, in radians; both of each pair are above the horizon.
    pub fn pattern(&self) -> impl ExactSizeIterator<Item = Angles<f32>> + Clone + 'a {
        self.pattern.iter().map(check::angles)
    }

    /// The directions to measure, as unit vectors, each pair with its index in the pattern.
    pub fn directions(&self) -> impl ExactSizeIterator<Item = (u16, Directions<f32>)> + Clone + 'a {
        // At most MAX_SAMPLES, which a u16 holds.
        self.pattern().enumerate().map(|(index, angles)| {
            let directions = HalfDifference::from_angles(angles).directions();
            (index as u16, directions)
        })
    }

    /// Its metadata, decoded and checked now: a scan needs none of it.
    ///
    /// # Errors
    /// Which section or field makes no sense.
    pub fn metadata(&self) -> Result<Metadata<'a>, RecipeError> {
        metadata::read(self.sections)
    }

    /// The first sample of the pattern that a machine does not reach, and why: to be asked before
    /// anything moves. None if it reaches all.
    #[must_use]
    pub fn out_of_reach(&self, limits: &Limits) -> Option<(u16, Unreachable)> {
        let mut directions = self.directions();
        directions.find_map(|(index, directions)| Some((index, limits.check(&directions).err()?)))
    }

    /// The loss to expect on a material that training never saw. None if the recipe states none, or
    /// if that statement makes no sense: [`Recipe::metadata`] says why. Other statements are not decoded.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        Some(metadata::expectation(self.sections)?.loss)
    }

    /// All sections with their postcard bytes, also those of kinds that are unknown here.
    #[must_use]
    pub fn sections(&self) -> Sections<'a> {
        self.sections
    }

    /// The CRC-32 in its header: names the recipe on the link.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}
