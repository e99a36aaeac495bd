//! Recipe files, and the recipe of a training run.

mod describe;
mod file;
mod quantise;

pub use describe::{NoRecipe, describe_options, describe_training, recipe_of, split_in_words};
pub use file::{
    RecipeFile, RecipeFileError, Statements, to_completed_recipe, to_recipe, to_ridge_recipe,
};
