//! Recipe files, their sections, and their metadata: the options of the training and its expected loss.

mod at_directions;
pub mod expected_loss;
mod file;
pub mod identity;
mod metadata;
mod noise;
pub mod options;
pub mod sections;

pub use file::{RecipeDefect, RecipeFile, RecipeFileError};
pub use metadata::{Metadata, MetadataError, Training};
pub use noise::ReadingNoise;
