//! The recipe: the trainer's result for the device.
//!
//! [`Recipe::parse`] checks everything that a scan needs, so a parsed `Recipe` never makes a scan fail. It borrows the
//! bytes (in flash) and copies only a few numbers.
//!
//! A recipe consists of a header and sections, each a number and postcard bytes. The document
//! [`docs/recipe.md`](https://docs.rs/crate/glimpse-core/latest/source/docs/recipe.md) specifies it.

mod contents;
mod header;

internal! { contents::{Contents, METADATA, Pattern} }
internal! { header::{FORMAT, SECTIONS_START} }
pub use header::memory_words;

use crate::error::{Error, ErrorCode};
use crate::fit::Estimator;
use crate::geometry::{Angles, Directions, HalfDifference};
use crate::model::ModelKind;

/// A checked recipe in memory or in flash.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    pattern: Pattern<'a>,
    pub(crate) estimator: Estimator<'a>,
    metadata: &'a [u8],
    checksum: u32,
}

impl<'a> Recipe<'a> {
    /// Parses a recipe in place.
    ///
    /// ```
    /// use glimpse_core::error::{Error, ErrorCode};
    /// use glimpse_core::recipe::Recipe;
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
    /// assert_eq!(error.code, ErrorCode::RecipeLength);
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// The first defect of the bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let body = header::read(bytes)?;
        let contents = Contents::decode(body.sections)?;
        let (pattern, estimator) = contents.check()?;
        let recipe = Self {
            pattern,
            estimator,
            metadata: contents.metadata,
            checksum: body.checksum,
        };
        let stated = [body.samples.into(), body.words];
        if [recipe.samples() as u32, recipe.memory_words() as u32] != stated {
            return Err(Error::with(ErrorCode::RecipeHeader, stated));
        }
        Ok(recipe)
    }

    /// The model that the recipe fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.estimator.model()
    }

    /// The number of values of a fit: the model's parameters, or for Linear one coefficient per component and channel.
    #[must_use]
    pub fn values(&self) -> usize {
        self.estimator.values()
    }

    /// Returns true if a fit tolerates missing readings, so that a scan may skip samples.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.estimator.tolerates_missing()
    }

    /// Returns true if the recipe bounds the loss of a fit with some of the readings, so that a scan may stop at a
    /// [target loss](crate::driver::Config::target_loss).
    #[must_use]
    pub fn bounds_partial_loss(&self) -> bool {
        self.estimator.bounds_partial_loss()
    }

    /// The CRC-32 of the host's basis file, which turns Linear's coefficients into a BRDF. None without a basis.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        self.estimator.basis_checksum()
    }

    /// The stages of the fit.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn estimator(&self) -> &Estimator<'a> {
        &self.estimator
    }

    /// n, the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.pattern.directions.len() / 3
    }

    /// The memory of a scan in words of 4 bytes: [`memory_words`] at run time.
    #[must_use]
    pub fn memory_words(&self) -> usize {
        self.estimator.scan_words(self.samples())
    }

    /// The angles of the directions to measure, in radians. Both directions of each sample are above the horizon.
    pub fn pattern(&self) -> impl ExactSizeIterator<Item = Angles<f32>> + Clone + 'a {
        self.pattern.directions.triples().map(Angles::from_array)
    }

    /// The directions to measure, as unit vectors. Each pair has its index in the pattern.
    pub fn directions(&self) -> impl ExactSizeIterator<Item = (u16, Directions<f32>)> + Clone + 'a {
        // At most MAX_SAMPLES, which a u16 holds.
        self.pattern().enumerate().map(|(index, angles)| {
            let directions = HalfDifference::from_angles(angles).directions();
            (index as u16, directions)
        })
    }

    /// The expected loss on a material that was not in the training data. None if it is unknown.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        self.pattern.expected_loss
    }

    /// Returns true if the samples are in the order of a path that takes little time. Read such a recipe's samples in its
    /// own order.
    #[must_use]
    pub fn is_in_path_order(&self) -> bool {
        self.pattern.is_path
    }

    /// The trainer's own section, in its own encoding. Empty if the recipe has none.
    #[must_use]
    pub fn metadata(&self) -> &'a [u8] {
        self.metadata
    }

    /// The CRC-32 in the header, which identifies the recipe on the link.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}
