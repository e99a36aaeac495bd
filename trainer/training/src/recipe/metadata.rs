//! The metadata of a recipe: one section that core passes through, and only the trainer reads.
//!
//! The section holds a version, one byte, and then the fields of [`Metadata`] in their order, each as
//! [postcard](https://postcard.jamesmunns.com/wire-format) encodes it. A recipe without the section has
//! [`Metadata::default`]. A change of the types below, or of the types that they hold, needs another version.

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_materials::{Identity, SourceShare};
use serde::{Deserialize, Serialize};

use crate::linear::Prior;
use crate::meta::expected_loss::ValidatedLoss;
use crate::meta::options::Options;
use crate::meta::plan::TrainedParts;
use crate::meta::plan::{Effort, Schedule};
use crate::meta::scan_budget::ScanBudget;
use crate::meta::tasks::task::Noise;
use crate::route::Machine;

/// The version of the encoding.
const VERSION: u8 = 2;

/// The metadata of a recipe. A fit needs none of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metadata {
    /// The limits of the machine that the pattern was trained for, in radians; None for no limits.
    pub limits: Option<Limits>,
    /// The noise of the readings in training; None for no noise.
    pub noise: Option<Noise>,
    /// The budget for the time of a scan that the pattern was trained for. All of its numbers are 0 or more.
    pub scan_budget: Option<ScanBudget>,
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
    /// The sources of the training tasks, each with a share of 0 to 1. With schedule prior, the added procedural
    /// materials are the last source. Empty if the sources are unknown.
    pub sources: Vec<SourceShare>,
    /// The schedule.
    pub schedule: Schedule,
    /// The effort.
    pub effort: Effort,
    /// The trained parts.
    pub parts: TrainedParts,
    /// Other options that affect the result, in words.
    pub options: String,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The [digest](Options::digest) of all options that affect the result. Recipes with the same digest were trained
    /// with the same options.
    pub digest: u64,
}

/// A defect of a recipe's metadata.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetadataError {
    /// Another version wrote the metadata.
    #[error(
        "the recipe's metadata has version {0}, and this trainer reads version {VERSION}; use the trainer that wrote \
         the recipe"
    )]
    Version(u8),
    /// The bytes of a field do not follow its encoding, or hold invalid [`Limits`].
    #[error("the field `{0}` of the recipe's metadata is damaged; train the recipe again")]
    Encoding(&'static str),
    /// Bytes follow the last field.
    #[error("{0} bytes follow the recipe's metadata; train the recipe again")]
    Trailing(usize),
    /// A number is out of range.
    #[error(
        "the field `{field}` of the recipe's metadata is {value}, and must be 0 to {max:e}; train the recipe again"
    )]
    Range {
        /// The field.
        field: &'static str,
        /// The number.
        value: f64,
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
        // Serialization of numbers, strings, enums and lists of known length cannot fail.
        postcard::to_stdvec(&(VERSION, self)).unwrap_or_default()
    }

    /// Decodes and checks metadata. Empty bytes are the default.
    ///
    /// # Errors
    /// The first defect.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MetadataError> {
        let Some((version, mut bytes)) = bytes.split_first() else {
            return Ok(Self::default());
        };
        if *version != VERSION {
            return Err(MetadataError::Version(*version));
        }
        let metadata = Self {
            limits: decode_field(&mut bytes, "limits")?,
            noise: decode_field(&mut bytes, "noise")?,
            scan_budget: decode_field(&mut bytes, "scan_budget")?,
            expected_loss: decode_field(&mut bytes, "expected_loss")?,
            training: decode_field(&mut bytes, "training")?,
            materials: decode_field(&mut bytes, "materials")?,
        };
        if !bytes.is_empty() {
            return Err(MetadataError::Trailing(bytes.len()));
        }
        metadata.check()?;
        Ok(metadata)
    }

    /// Returns the machine that the recipe was trained for. Fields that the metadata do not state have their defaults.
    #[must_use]
    pub fn machine(&self) -> Machine {
        let limits = self.limits.unwrap_or(Limits::NONE);
        match &self.scan_budget {
            Some(budget) => budget.machine(limits),
            None => Machine {
                limits,
                ..Machine::default()
            },
        }
    }

    fn check(&self) -> Result<(), MetadataError> {
        if let Some(noise) = self.noise {
            in_range("noise.multiplicative", noise.multiplicative, f32::MAX)?;
            in_range("noise.additive", noise.additive, f32::MAX)?;
        }
        if let Some(budget) = self.scan_budget {
            for speed in budget.speeds.to_array() {
                in_range("scan_budget.speeds", speed, f32::MAX)?;
            }
            in_range("scan_budget.settle", budget.settle, f32::MAX)?;
            in_range("scan_budget.seconds", budget.seconds, f32::MAX)?;
        }
        if let Some(ValidatedLoss { estimate, .. }) = self.expected_loss {
            in_range("expected_loss.loss", estimate.loss, f32::MAX)?;
            let error = estimate.standard_error.unwrap_or_default();
            in_range("expected_loss.standard_error", error, f32::MAX)?;
        }
        for source in self.training.iter().flat_map(|each| &each.sources) {
            in_range("training.sources.share", source.share, 1.0)?;
        }
        Ok(())
    }

    /// Describes the materials of the expected loss in words that follow their number; None if they are unknown.
    #[must_use]
    pub fn validation_materials(&self) -> Option<String> {
        let (training, expected) = self.training.as_ref().zip(self.expected_loss)?;
        let split = expected.split.description();
        Some(format!("materials of {} {split}", training.data))
    }
}

fn decode_field<'a, T: Deserialize<'a>>(
    bytes: &mut &'a [u8],
    field: &'static str,
) -> Result<T, MetadataError> {
    let (value, rest) =
        postcard::take_from_bytes(bytes).map_err(|_| MetadataError::Encoding(field))?;
    *bytes = rest;
    Ok(value)
}

fn in_range(field: &'static str, value: impl Into<f64>, max: f32) -> Result<(), MetadataError> {
    let value = value.into();
    // This form of the condition rejects NaN too.
    match (0.0..=f64::from(max)).contains(&value) {
        true => Ok(()),
        false => Err(MetadataError::Range { field, value, max }),
    }
}

impl Training {
    /// Returns the training with these options. `data` is the name of the materials, and `materials` their number.
    #[must_use]
    pub fn new(options: &Options, data: &str, materials: usize) -> Self {
        let Prior { components, eta } = options.prior;
        Self {
            trainer: concat!("glimpse-trainer ", env!("CARGO_PKG_VERSION")).to_owned(),
            data: data.to_owned(),
            materials,
            sources: options.sources(),
            schedule: options.schedule,
            effort: options.effort,
            parts: options.parts,
            options: match (options.schedule, options.model) {
                (Schedule::Prior, _) => options.completion_options.to_string(),
                (_, ModelKind::Linear) => {
                    format!("{components} bases, eta {eta}")
                }
                _ => String::new(),
            },
            seed: options.seed,
            digest: options.digest(),
        }
    }

    /// Describes the schedule, the effort, and the trained parts unless they are all.
    #[must_use]
    pub fn describe_schedule(&self) -> String {
        let schedule = format!("{} {}", self.schedule.name(), self.effort.name());
        match self.parts {
            TrainedParts::All => schedule,
            parts => format!("{schedule}, parts {}", parts.name()),
        }
    }
}
