//! What leaves the trainer: recipes, and recipes in other clothes.

mod c;
mod comment;
mod csv;
mod json;
mod quantise;
mod recipe;
mod rust;
mod training;

pub use c::to_c;
pub use csv::to_csv;
pub use json::{eta, to_json};
pub use recipe::{
    RecipeFile, RecipeFileError, Statements, to_completed_recipe, to_recipe, to_ridge_recipe,
};
pub use rust::to_rust;
pub use training::{NoRecipe, describe_options, describe_training, recipe_of, split_in_words};
