//! Export of a recipe as JSON, complete enough to reimplement the fit.

use crate::recipe::{RecipeDefect, RecipeFile};
use glimpse_core::geometry::Arms;
use glimpse_core::recipe::Contents;
use serde_json::{Value, json};

/// Converts a recipe to JSON.
///
/// It has the sections and fields of `core/docs/recipe.md`; a section that the recipe lacks is null. Lists of numbers are
/// flat. Rows of components are numbers as in the fit. Bytes are 0 to 255, where 128 and more stand for -128 to -1.
///
/// The key `metadata` has the fields of [`Metadata`](crate::recipe::Metadata). The keys `model`, `samples` (n),
/// `arms` (rows of theta_i, phi_i, theta_o, phi_o in radians), `memory_words` and `checksum` follow from the sections.
///
/// # Errors
/// Never, because the recipe was parsed.
pub fn to_json(file: &RecipeFile) -> Result<Value, RecipeDefect> {
    let recipe = file.recipe();
    let arms: Vec<[f32; 4]> = recipe
        .directions()
        .map(|(_, directions)| Arms::from_directions(&directions).to_array())
        .collect();
    let mut value = json!(Contents::read(file.bytes())?);
    value["metadata"] = json!(file.metadata());
    value["model"] = json!(recipe.model());
    value["samples"] = json!(recipe.samples());
    value["arms"] = json!(arms);
    value["memory_words"] = json!(recipe.memory_words());
    value["checksum"] = json!(format!("{:08x}", recipe.checksum()));
    Ok(value)
}
