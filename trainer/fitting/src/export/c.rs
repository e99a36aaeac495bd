//! Export of a recipe's bytes as C source, for firmware with the C library and without a file system.

use std::fmt::Write;

use crate::recipe::RecipeFile;

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
    source
}
