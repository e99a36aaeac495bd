//! What leaves the trainer: recipes, and recipes in other clothes.

mod json;
mod recipe;
mod rust;

pub use json::{eta, to_json};
pub use recipe::{
    RecipeFile, RecipeFileError, ReducedBasis, Statements, to_recipe, to_ridge_recipe,
};
pub use rust::to_rust;
