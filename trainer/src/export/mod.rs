//! Export of recipes as C, CSV and JSON.

mod c;
mod comment;
mod csv;
mod json;

pub use c::to_c;
pub use csv::to_csv;
pub use json::{eta, expectation, to_json, training};
