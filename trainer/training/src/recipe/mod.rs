//! Recipe files, and conversion of training results to recipes.

mod describe;
mod file;
mod pack;
mod quantize;

pub use describe::{PackError, describe_options, describe_split, describe_training, pack_recipe};
pub use file::{RecipeFile, RecipeFileError};
pub use pack::{pack_fit, pack_pattern};
