//! Recipe files, and the recipe of a training run.

mod describe;
mod file;
mod pack;
mod quantize;

pub use describe::{DescribeError, describe_options, describe_training, recipe_of, split_in_words};
pub use file::{RecipeFile, RecipeFileError};
pub use pack::{packed_fit, packed_pattern};
