//! Export of recipes as C, CSV, JSON and Rust.

mod c;
mod comment;
mod csv;
mod json;
mod rust;

pub use c::to_c;
pub use csv::to_csv;
pub use json::{eta, expectation, to_json};
pub use rust::to_rust;
