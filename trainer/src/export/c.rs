//! A recipe as C source: its bytes, for firmware that links the C library and has no file system.

use std::fmt::Write;

use glimpse_core::recipe::{Recipe, RecipeError};

use super::comment::expected;

/// How many bytes stand on a line.
const A_LINE: usize = 16;

/// A header with one array, `glimpse_recipe_bytes`, of a recipe's bytes.
///
/// # Errors
/// If the bytes are no recipe, or what it states about itself makes no sense.
pub fn to_c(bytes: &[u8]) -> Result<String, RecipeError> {
    let recipe = Recipe::parse(bytes)?;
    let mut source = format!(
        "/* Recipe {:08x}: {} at n = {}.\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
    );
    if let Some(expectation) = recipe.metadata()?.expectation {
        source += &format!("   {}\n", expected(&expectation));
    }
    source += "   glimpse_scan_begin() and glimpse_recipe_describe() take the array and its size. */\n\n\
               #include <stdint.h>\n\n";
    let count = bytes.len();
    // Writing to a string cannot fail.
    let _ = writeln!(
        source,
        "static const uint8_t glimpse_recipe_bytes[{count}] = {{"
    );
    for line in bytes.chunks(A_LINE) {
        let line: Vec<String> = line.iter().map(|byte| format!("0x{byte:02x}")).collect();
        let _ = writeln!(source, "    {},", line.join(", "));
    }
    source += "};\n";
    Ok(source)
}
