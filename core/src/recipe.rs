//! The recipe: the trainer's result for the device.
//!
//! [`Recipe::parse`] checks everything that a scan needs, so a parsed `Recipe` never makes a scan fail. It borrows the
//! bytes (in flash) and copies only a few numbers. [`Recipe::metadata`] decodes the metadata on request.
//!
//! A recipe consists of magic, version, length and CRC-32, and then sections, each a [`Kind`] and postcard bytes. The
//! format grows by new kinds; older recipes stay readable. The document
//! [`docs/recipe.md`](https://docs.rs/crate/glimpse-core/latest/source/docs/recipe.md) specifies it, with an example
//! in bytes.

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
    HEADER_BYTES, MAGIC, MAX_BASIS, MAX_COMPONENTS, MAX_EXPONENT, MAX_GAUSS_NEWTON_STEPS,
    MAX_INNER_STEPS, MAX_MEAN, MAX_MEDIAN, MAX_PRECISION, MAX_PREDICTION, MAX_READING_WEIGHT,
    MAX_SAMPLES, MAX_VIRTUAL_READINGS, MAX_WEIGHT, MIN_PRECISION, VERSION,
};
pub use kind::Kind;
pub use metadata::Metadata;
pub use parts::{ExpectedLoss, Noise, Provenance, ScanTime};
internal! { parts::{PackedCoefficientNet, PackedDescent, PackedGaussNewton, PackedInitNet} }
internal! { parts::{PackedCorrection, PackedPartialLoss} }
internal! { parts::{PackedMethod, PackedRidge, PackedTarget, RecipeParts} }
pub use sections::{Materials, Sections};
pub use size::{max_samples, memory_words};
pub use training::{
    Effort, Origin, Parts, Schedule, Training, TrainingSource, TrainingSources, ValidationSplit,
};

use crate::error::Error;
use crate::fit::{Algorithm, AnyModel};
use crate::geometry::{Angles, Directions, HalfDifference};
use crate::gonio::Machine;
use crate::model::{ModelKind, SLOT_WORDS};
use check::PackedAngles;
use contents::Contents;
use header::CheckedBody;
use write::Writer;

/// A checked recipe in memory or in flash.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    pattern: &'a [PackedAngles],
    pub(crate) method: FitMethod<'a>,
    sections: Sections<'a>,
    checksum: u32,
}

impl<'a> Recipe<'a> {
    /// Parses a recipe in place.
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
    /// The first defect of the bytes. A parsed recipe never makes a scan fail. Its metadata is not checked here, but
    /// by [`Recipe::metadata`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, RecipeError> {
        let CheckedBody { checksum, body } = header::read(bytes)?;
        let contents = Contents::from_body(body)?;
        let pattern = check::pattern(contents.pattern)?;
        let method = check::method(contents.method, contents.estimate, pattern.len())?;
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
    /// [`RecipeError::BufferTooSmall`], or the error of [`Recipe::parse`] or [`Recipe::metadata`] for the result.
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
        // A prediction has no meaning without a completion. (A reader ignores it.)
        if parts.prediction.is_some() && recipe.completed().is_none() {
            return Err(RecipeError::Missing(Kind::COMPLETION));
        }
        Ok(bytes)
    }

    /// Copies the recipe without sections of these kinds into `buffer`, and returns the bytes used.
    ///
    /// The other sections stay the same to the bit, also those of unknown kinds. The copy has another checksum, and so
    /// another identity on the link. It takes at most as many bytes as the recipe.
    ///
    /// # Errors
    /// [`RecipeError::Required`] if a kind is required, or [`RecipeError::BufferTooSmall`].
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

    /// The model that the recipe fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.method.model()
    }

    /// The number of values of a fit: the model's parameters, or for Linear one coefficient per component and channel.
    #[must_use]
    pub fn values(&self) -> usize {
        self.method.values()
    }

    /// Returns true if a fit tolerates missing readings, so that a scan may skip samples.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.method.tolerates_missing()
    }

    /// Returns true if the recipe bounds the loss of a fit with some of the readings, so that a scan may stop at a
    /// [target loss](crate::driver::Config::target_loss).
    #[must_use]
    pub fn bounds_partial_loss(&self) -> bool {
        self.method.bounds_partial_loss()
    }

    /// The CRC-32 of the host's basis file, which turns Linear's coefficients into a BRDF. None without a basis.
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

    /// The descent of a recipe without a completion. None if the descent starts from
    /// [completed](Recipe::completed) readings.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn descent(&self) -> Option<Descent<'a>> {
        match self.method {
            FitMethod::Descent(descent) => Some(descent),
            _ => None,
        }
    }

    /// The ridge solve, if that is the recipe's method.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn ridge(&self) -> Option<Ridge<'a>> {
        match self.method {
            FitMethod::Ridge(ridge) => Some(ridge),
            _ => None,
        }
    }

    /// The completion of readings, if the recipe's method has one.
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

    /// The memory of a scan in words of 4 bytes: [`memory_words`] at run time.
    #[must_use]
    pub fn memory_words(&self) -> usize {
        // `AnyModel` never returns an error.
        let work = AnyModel::words(&self.method, self.samples()).unwrap_or_default();
        let slots = self.samples().saturating_mul(SLOT_WORDS);
        slots.saturating_add(work)
    }

    /// The angles of the directions to measure, in radians. Both directions of each sample are above the horizon.
    pub fn pattern(&self) -> impl ExactSizeIterator<Item = Angles<f32>> + Clone + 'a {
        self.pattern.iter().map(Angles::from_le_bytes)
    }

    /// The directions to measure, as unit vectors. Each pair has its index in the pattern.
    pub fn directions(&self) -> impl ExactSizeIterator<Item = (u16, Directions<f32>)> + Clone + 'a {
        // At most MAX_SAMPLES, which a u16 holds.
        self.pattern().enumerate().map(|(index, angles)| {
            let directions = HalfDifference::from_angles(angles).directions();
            (index as u16, directions)
        })
    }

    /// Decodes and checks the metadata. A scan needs none of it.
    ///
    /// # Errors
    /// The first invalid section or field.
    pub fn metadata(&self) -> Result<Metadata<'a>, RecipeError> {
        metadata::read(self.sections)
    }

    /// The first sample of the pattern that a machine cannot reach, and the reason. None if it reaches all samples.
    ///
    /// Call this before anything moves.
    #[must_use]
    pub fn out_of_reach(&self, machine: &Machine) -> Option<(u16, Error)> {
        let mut directions = self.directions();
        directions.find_map(|(index, directions)| Some((index, machine.check(&directions).err()?)))
    }

    /// The expected loss on a material that was not in the training data. None if the recipe states none or an
    /// invalid one; [`Recipe::metadata`] returns the reason. Other metadata is not decoded.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        Some(metadata::read_expectation(self.sections)?.loss)
    }

    /// Returns true if the samples are in the order of a path that takes little time, which the recipe
    /// [states](Metadata::scan_time). Read such a recipe's samples in its own order.
    #[must_use]
    pub fn is_in_path_order(&self) -> bool {
        let mut sections = self.sections;
        sections.any(|(kind, _)| kind == Kind::SCAN_TIME)
    }

    /// All sections with their postcard bytes, also those of unknown kinds.
    #[must_use]
    pub fn sections(&self) -> Sections<'a> {
        self.sections
    }

    /// The CRC-32 in the header, which identifies the recipe on the link.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}
