//! Export of recipes as C and JSON.

mod c;
mod json;

pub use c::to_c;
pub use json::to_json;
