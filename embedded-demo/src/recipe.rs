//! The recipe, its model, and the sizes that follow from it. `build.rs` has the path of the recipe.

use glimpse_core::recipe::{max_samples, memory_words};
use glimpse_core::scan;

include!(concat!(env!("OUT_DIR"), "/recipe.rs"));

/// A scan with the recipe.
pub type Scan = scan::Scan<'static, Model>;
/// Number of samples.
pub const SAMPLES: usize = max_samples(&[RECIPE]);
/// Words of memory for readings and fit.
pub const MEMORY_WORDS: usize = memory_words(&[RECIPE]);
