//! Description of a recipe.

use glimpse_core::recipe::Recipe;

use crate::configuration::CScan;
use crate::pointer::{Out, slice, status};
use crate::status::glimpse_status;
use crate::types::{glimpse_model, glimpse_recipe};

/// Checks a recipe and describes it.
///
/// @param bytes   The recipe, as written by trainer, with any alignment, in flash or in RAM.
/// @param count   Number of bytes.
/// @param recipe  Receives the description.
/// @return GLIMPSE_STATUS_RECIPE_... if the bytes are not a valid recipe; GLIMPSE_STATUS_MODEL if the
///         library was built for another model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn glimpse_recipe_describe(
    bytes: *const u8,
    count: usize,
    recipe: *mut glimpse_recipe,
) -> glimpse_status {
    // SAFETY: the C caller keeps the contract of the header.
    status(unsafe { describe(bytes, count, recipe) })
}

unsafe fn describe(
    bytes: *const u8,
    count: usize,
    out: *mut glimpse_recipe,
) -> Result<(), glimpse_status> {
    // SAFETY: guaranteed by the caller.
    let (out, bytes) = unsafe { (Out::new(out)?, slice(bytes, count)?) };
    let recipe = Recipe::parse(bytes)?;
    CScan::accept(&recipe, usize::MAX)?;
    out.put(glimpse_recipe {
        model: glimpse_model::try_from(recipe.model())?,
        samples: recipe.samples() as u16,
        values: recipe.values() as u16,
        checksum: recipe.checksum(),
        expected_loss: recipe.expected_loss().unwrap_or(f32::NAN),
    });
    Ok(())
}
