//! The recipe, and memory for every recipe of the trainer with up to 64 samples.

use core::hint::black_box;

use glimpse_core::fit::AnyModel;
use glimpse_core::scan;

/// The built-in recipe.
static BUILT_IN: &[u8] = include_bytes!("../../trainer/recipes/paper/neural-n8.recipe");

/// A scan with a recipe of any model.
pub type Scan = scan::Scan<'static, AnyModel>;
/// Words of memory for readings and fit.
pub const MEMORY_WORDS: usize = 3_584;

// SAFETY: the linker script reserves this sector of the flash for the static alone, and any bytes are valid.
unsafe extern "C" {
    /// The last sector of the flash. It is erased, or holds a recipe that was flashed separately from the firmware.
    #[link_name = "_recipe"]
    safe static SECTOR: [u8; 128 * 1024];
}

/// Returns the recipe in the last sector of the flash, or the built-in one if there is none.
pub fn recipe() -> &'static [u8] {
    // Hidden from the compiler, because bits in flash may flip after the build.
    let (built_in, sector) = black_box((BUILT_IN, &SECTOR));
    // A header begins with its magic number, the version, and the length of the body. It has 14 bytes.
    let [b'G', b'L', b'M', b'P', _, _, a, b, c, d, ..] = *sector else {
        return built_in;
    };
    let end = (u32::from_le_bytes([a, b, c, d]) as usize).saturating_add(14);
    sector.get(..end).unwrap_or(sector)
}
