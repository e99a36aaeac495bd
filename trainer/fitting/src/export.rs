//! Export of recipes as JSON, and as C source for firmware with the C library and without a file system.

use crate::recipe::{RecipeDefect, RecipeFile};
use glimpse_core::geometry::Arms;
use glimpse_core::recipe::Contents;
use serde_json::{Value, json};

/// The number of bytes per line.
const BYTES_PER_LINE: usize = 16;

/// Returns a C header with a recipe's bytes in an array, `glimpse_recipe_bytes`.
#[must_use]
pub fn to_c(file: &RecipeFile) -> String {
    let (recipe, bytes) = (file.recipe(), file.bytes());
    let mut source = format!(
        "/* Recipe {:08x}: {} at n = {}.\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
    );
    if let Some(loss) = recipe.expected_loss() {
        source += &format!("   Expected loss: {loss:.4}.\n");
    }
    source += "   glimpse_scan_begin() and glimpse_recipe_describe() take the array and its size. */\n\n\
               #include <stdint.h>\n\n";
    let count = bytes.len();
    source += &format!("static const uint8_t glimpse_recipe_bytes[{count}] = {{\n");
    for chunk in bytes.chunks(BYTES_PER_LINE) {
        let line: Vec<String> = chunk.iter().map(|byte| format!("0x{byte:02x}")).collect();
        source += &format!("    {},\n", line.join(", "));
    }
    source += "};\n";
    source
}

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
