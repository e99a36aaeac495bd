//! Recipe files, and their metadata.

mod at_directions;
mod file;
mod metadata;

pub use file::{RecipeDefect, RecipeFile, RecipeFileError};
pub use metadata::{Metadata, MetadataError, Training};
