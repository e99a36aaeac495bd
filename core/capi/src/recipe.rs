//! Description of a recipe.

use glimpse_core::recipe::{Kind, Recipe};

use crate::configuration::CScan;
use crate::place::{Out, list, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_model, glimpse_recipe};

/// Checks a recipe and describes it.
///
/// @param bytes   The recipe, as written by trainer, with any alignment, in flash or in RAM.
/// @param count   Number of bytes.
/// @param recipe  Receives the description.
/// @return GLIMPSE_STATUS_RECIPE_... if the bytes are not a whole recipe; GLIMPSE_STATUS_MODEL if the
///         library was built for another model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_recipe_describe(
    bytes: *const u8,
    count: usize,
    recipe: *mut glimpse_recipe,
) -> glimpse_status {
    // SAFETY: C keeps the contract in the header.
    status(unsafe { describe(bytes, count, recipe) })
}

unsafe fn describe(
    bytes: *const u8,
    count: usize,
    out: *mut glimpse_recipe,
) -> Result<(), glimpse_status> {
    // SAFETY: by the caller's word.
    let (out, bytes) = unsafe { (Out::new(out)?, list(bytes, count)?) };
    let recipe = Recipe::parse(bytes)?;
    CScan::accept(&recipe, usize::MAX)?;
    out.put(glimpse_recipe {
        model: glimpse_model::try_from(recipe.model())?,
        samples: recipe.samples() as u16,
        values: values(&recipe),
        checksum: recipe.checksum(),
        expected_loss: recipe.expected_loss().unwrap_or(f32::NAN),
    });
    Ok(())
}

/// Number of values of a fit: the model's parameters, or a coefficient for each component and channel.
fn values(recipe: &Recipe<'_>) -> u16 {
    if let Some(parameters) = recipe.model().parameters() {
        return parameters as u16;
    }
    // Both kinds begin with the number of components (`core/docs/recipe.md`).
    let mut sections = recipe.sections();
    let section = sections.find(|(kind, _)| [Kind::RIDGE, Kind::COMPLETION].contains(kind));
    let components = section.and_then(|(_, bytes)| postcard::take_from_bytes::<u16>(bytes).ok());
    components.map_or(0, |(components, _)| components.saturating_mul(3))
}
