//! Export of a recipe's bytes as C source, for firmware with the C library and without a file system.

use std::fmt::Write;

use glimpse_core::recipe::{Recipe, RecipeError};

use super::comment::expected_loss_text;

/// The number of bytes per line.
const BYTES_PER_LINE: usize = 16;

/// Returns a C header with a recipe's bytes in an array, `glimpse_recipe_bytes`.
///
/// # Errors
/// If the bytes are not a recipe, or its metadata are invalid.
pub fn to_c(bytes: &[u8]) -> Result<String, RecipeError> {
    let recipe = Recipe::parse(bytes)?;
    let mut source = format!(
        "/* Recipe {:08x}: {} at n = {}.\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
    );
    if let Some(expectation) = recipe.metadata()?.expectation {
        source += &format!("   {}\n", expected_loss_text(&expectation));
    }
    source += "   glimpse_scan_begin() and glimpse_recipe_describe() take the array and its size. */\n\n\
               #include <stdint.h>\n\n";
    let count = bytes.len();
    // Writing to a string cannot fail.
    let _ = writeln!(
        source,
        "static const uint8_t glimpse_recipe_bytes[{count}] = {{"
    );
    for chunk in bytes.chunks(BYTES_PER_LINE) {
        let line: Vec<String> = chunk.iter().map(|byte| format!("0x{byte:02x}")).collect();
        let _ = writeln!(source, "    {},", line.join(", "));
    }
    source += "};\n";
    Ok(source)
}
