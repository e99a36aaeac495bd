//! What leaves the trainer: recipes, and recipes in other clothes.

mod json;
mod recipe;
mod rust;

pub use json::to_json;
pub use recipe::{RecipeFile, RecipeFileError, to_recipe};
pub use rust::to_rust;
