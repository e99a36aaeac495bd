//! Tables of constants, as text that is part of the program.

use csv::Trim;
use serde::de::DeserializeOwned;

/// Parses the rows of a table of constants: fields between commas, without titles. Lines that begin with `#` are comments. The
/// fields of a missing group of fields are one empty field.
///
/// # Panics
/// If a row does not have the fields of `T`.
#[must_use]
pub fn rows<T: DeserializeOwned>(table: &str) -> Vec<T> {
    let mut reader = csv::ReaderBuilder::new();
    let reader = reader.comment(Some(b'#')).has_headers(false);
    let reader = reader.trim(Trim::All).flexible(true);
    let rows = reader.from_reader(table.as_bytes()).into_deserialize();
    let rows = rows.collect::<Result<_, _>>();
    rows.expect("the rows have the fields of their type")
}
