//! The metadata of a recipe: one section that core passes through, and only the trainer reads.
//!
//! The section holds [`Metadata`] as [postcard](https://postcard.jamesmunns.com/wire-format) encodes it. A recipe without
//! the section has [`Metadata::default`].

use glimpse_core::recipe::Recipe;
use glimpse_materials::Identity;
use serde::{Deserialize, Serialize};

use super::expected_loss::ValidatedLoss;
use super::options::{OptionsError, TrainedParts, TrainingOptions};
use crate::choice::Choice;
use crate::route::TimedMachine;

/// The metadata of a recipe. A fit needs none of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// The expected loss, its standard error (both 0 or more), and the materials that it was measured on.
    pub expected_loss: Option<ValidatedLoss>,
    /// The training.
    pub training: Option<Training>,
    /// The names of the training materials, and the digests of their BRDFs. Empty if they are unknown.
    pub materials: Vec<Identity>,
}

/// The training of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Training {
    /// The program that trained the recipe, and its version.
    pub trainer: String,
    /// The name of the training materials.
    pub data: String,
    /// The number of training materials.
    pub materials: usize,
    /// The options.
    pub options: TrainingOptions,
}

/// A defect of a recipe's metadata.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetadataError {
    /// The bytes are not those of [`Metadata`].
    #[error(
        "the recipe's metadata is damaged, or of another version of the trainer; train the recipe again"
    )]
    Encoding,
    /// The options of the training are invalid.
    #[error("the options in the recipe's metadata are invalid: {0}; train the recipe again")]
    Options(#[from] OptionsError),
    /// A number is out of range.
    #[error(
        "the field `{field}` of the recipe's metadata is {value}, and must be 0 to {max:e}; train the recipe again"
    )]
    Range {
        /// The field.
        field: &'static str,
        /// The number.
        value: f32,
        /// The maximum.
        max: f32,
    },
}

impl Metadata {
    /// Decodes and checks the metadata of a recipe.
    ///
    /// # Errors
    /// See [`Metadata::from_bytes`].
    pub fn of(recipe: &Recipe<'_>) -> Result<Self, MetadataError> {
        Self::from_bytes(recipe.metadata())
    }

    /// Encodes the metadata. The default has no bytes. [`Metadata::from_bytes`] checks the numbers.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        if *self == Self::default() {
            return Vec::new();
        }
        postcard::to_stdvec(self).expect("lists of known length have an encoding")
    }

    /// Decodes and checks metadata. Empty bytes are the default.
    ///
    /// # Errors
    /// The first defect.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MetadataError> {
        if bytes.is_empty() {
            return Ok(Self::default());
        }
        let Ok((metadata, [])) = postcard::take_from_bytes::<Self>(bytes) else {
            return Err(MetadataError::Encoding);
        };
        if let Some(ValidatedLoss { estimate, .. }) = metadata.expected_loss {
            in_range("expected_loss.loss", estimate.loss, f32::MAX)?;
            let error = estimate.standard_error.unwrap_or_default();
            in_range("expected_loss.standard_error", error, f32::MAX)?;
        }
        if let Some(options) = metadata.options() {
            options.validate()?;
            for source in &options.source_shares {
                in_range("training.options.source_shares.share", source.share, 1.0)?;
            }
        }
        Ok(metadata)
    }

    /// Returns the options of the training; None if they are unknown.
    #[must_use]
    pub fn options(&self) -> Option<&TrainingOptions> {
        self.training.as_ref().map(|training| &training.options)
    }

    /// Returns the longest time of a scan that the pattern was trained for, in seconds; None for any time.
    #[must_use]
    pub fn scan_seconds(&self) -> Option<f64> {
        self.options()?.scan_seconds
    }

    /// Returns the machine that the recipe was trained for, or the default one.
    #[must_use]
    pub fn machine(&self) -> TimedMachine {
        self.options()
            .map_or_else(TimedMachine::default, TrainingOptions::machine)
    }

    /// Describes the materials of the expected loss in words that follow their number; None if they are unknown.
    #[must_use]
    pub fn validation_materials(&self) -> Option<String> {
        let (training, expected) = self.training.as_ref().zip(self.expected_loss)?;
        let split = expected.split.description();
        Some(format!("materials of {} {split}", training.data))
    }
}

fn in_range(field: &'static str, value: f32, max: f32) -> Result<(), MetadataError> {
    // This form of the condition rejects NaN too.
    if (0.0..=max).contains(&value) {
        Ok(())
    } else {
        Err(MetadataError::Range { field, value, max })
    }
}

impl Training {
    /// Returns the training with these options. `data` is the name of the materials, and `materials` their number.
    #[must_use]
    pub fn new(options: &TrainingOptions, data: &str, materials: usize) -> Self {
        Self {
            trainer: concat!("glimpse-trainer ", env!("CARGO_PKG_VERSION")).to_owned(),
            data: data.to_owned(),
            materials,
            options: options.clone(),
        }
    }

    /// Describes the schedule, the effort, and the trained parts unless they are all.
    #[must_use]
    pub fn describe_schedule(&self) -> String {
        let options = &self.options;
        let parts = match options.parts {
            TrainedParts::All => "",
            TrainedParts::AllTwice => ", parts all-twice",
            TrainedParts::PatternOnly(_) => ", parts pattern-only",
        };
        let [schedule, effort] = [options.schedule.name(), options.effort.name()];
        format!("{schedule} {effort}{parts}")
    }
}
