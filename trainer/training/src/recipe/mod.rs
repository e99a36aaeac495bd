//! Recipe files, and conversion of training results to recipes.

mod at_directions;
mod file;
mod metadata;
mod pack;
mod quantize;

pub use file::{RecipeDefect, RecipeFile, RecipeFileError};
pub use metadata::{Metadata, MetadataError, Training};
pub use pack::{PackError, pack_fit, pack_recipe};
