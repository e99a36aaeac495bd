//! What is in a recipe, and whether this library can scan by it.

use glimpse_core::fit::{FitMethod, Target};
use glimpse_core::recipe::Recipe;

use crate::configuration::CScan;
use crate::place::{Out, list, status};
use crate::status::glimpse_status;
use crate::types::glimpse_recipe;

/// Checks a recipe, and whether this library was built for it; says what is in it.
///
/// @param bytes   The recipe, which trainer wrote; of any alignment, in flash or in RAM.
/// @param count   How many bytes these are.
/// @param recipe  What is in it.
/// @return GLIMPSE_STATUS_RECIPE_...: the bytes are no whole recipe. GLIMPSE_STATUS_MODEL,
///         GLIMPSE_STATUS_SAMPLES, GLIMPSE_STATUS_COMPONENTS: it is one, but not for this library.
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
    CScan::accept(&recipe)?;
    let method = recipe.method();
    let values = match &method {
        FitMethod::Descent(descent) => descent.initial().len(),
        FitMethod::Ridge(ridge) => ridge.components().saturating_mul(3),
        FitMethod::Completed(completed) => match completed.target() {
            Target::Linear(components) => components.scales().len().saturating_mul(3),
            Target::Descent(descent, _) => descent.initial().len(),
        },
    };
    out.put(glimpse_recipe {
        model: recipe.model().into(),
        samples: recipe.samples() as u16,
        values: values as u16,
        checksum: recipe.checksum(),
        expected_loss: recipe.expected_loss().unwrap_or(f32::NAN),
    });
    Ok(())
}
