//! A CSV file whose first line names the columns, in any order.

use std::path::{Path, PathBuf};

use csv::{Position, ReaderBuilder, StringRecord, Trim};
use glimpse_materials::untrusted::{escaped, read_at_most};
use serde::Deserialize;

/// The maximum size of a file in bytes, which holds more than a million rows.
const MAX_BYTES: u64 = 1 << 28;

/// An error in reading a file of measurements.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The operating system cannot read the file.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The content is not a table with the expected columns and cells.
    #[error("{}: {message}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line and column, the problem, and the remedy.
        message: String,
    },
    /// Readings are at other directions than those of a recipe.
    #[error("{}: {message}; fit them with a recipe of `--samples any`", path.display())]
    OffPattern {
        /// The file.
        path: PathBuf,
        /// The line, and its distance from the nearest sample.
        message: String,
    },
}

/// A table: the column names in lowercase, and the rows.
pub(super) struct Table {
    path: PathBuf,
    header: StringRecord,
    rows: Vec<Row>,
}

/// A row and the line of the file on which it begins.
pub(super) struct Row {
    pub(super) line: u64,
    cells: StringRecord,
}

impl Table {
    /// Reads a whole file.
    pub(super) fn read(path: &Path) -> Result<Self, TableError> {
        let bytes = read_at_most(path, MAX_BYTES).map_err(|source| TableError::Read {
            path: path.into(),
            source,
        })?;
        let damaged = |message| TableError::Damaged {
            path: path.into(),
            message,
        };
        let syntax_error = |error: csv::Error| {
            damaged(csv_error_message(
                &error,
                line_number(&bytes, error.position()),
            ))
        };
        let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(&bytes[..]);
        let header = reader.headers().map_err(syntax_error)?.clone();
        if let Some(message) = separator_error(&header) {
            return Err(damaged(message));
        }
        let rows = reader.records().map(|cells| {
            let cells = cells.map_err(syntax_error)?;
            let line = line_number(&bytes, cells.position());
            Ok(Row { line, cells })
        });
        let rows = rows.collect::<Result<_, TableError>>()?;
        Ok(Self {
            path: path.into(),
            header: header.iter().map(str::to_ascii_lowercase).collect(),
            rows,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the escaped names of all columns, separated by commas.
    pub(super) fn names(&self) -> String {
        escaped(&self.header.iter().collect::<Vec<_>>().join(", "))
    }

    /// Returns all rows.
    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns true if the table has all columns with these names.
    pub(super) fn has(&self, names: &[&str]) -> bool {
        let has = |name: &&str| self.header.iter().any(|column| column == *name);
        names.iter().all(has)
    }

    /// Returns the text of a cell; empty if the column does not exist.
    pub(super) fn cell<'a>(&self, row: &'a Row, column: &str) -> &'a str {
        let index = self.header.iter().position(|name| name == column);
        index.map_or("", |index| &row.cells[index])
    }

    /// Parses the columns of a row that `T` has as fields. Empty cells and missing columns are None.
    pub(super) fn parse<'a, T: Deserialize<'a>>(&'a self, row: &'a Row) -> Result<T, TableError> {
        row.cells.deserialize(Some(&self.header)).map_err(|error| {
            let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
                return self.line_error(row.line, &format!("{error}; correct the line"));
            };
            let column = err.field().and_then(|field| usize::try_from(field).ok());
            let message =
                match column.and_then(|index| self.header.get(index).zip(row.cells.get(index))) {
                    Some((name, cell)) => format!(
                        "column {name}: `{}` is not a valid number; {}",
                        escaped(cell),
                        remedy(name)
                    ),
                    // Two columns of the same name.
                    None => format!("{}; remove or rename one", err.kind()),
                };
            self.line_error(row.line, &message)
        })
    }

    /// Returns an error that concerns the whole file.
    pub(super) fn file_error(&self, message: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            message,
        }
    }

    /// Returns an error that concerns one line; `message` may begin with the column.
    pub(super) fn line_error(&self, line: u64, message: &str) -> TableError {
        self.file_error(format!("line {line}, {message}"))
    }
}

/// Returns the remedy of a cell that is not a number.
fn remedy(column: &str) -> &'static str {
    match column {
        "index" => "give the sample's number, 0, 1, 2, ...",
        "saturated" => "give 1 if the sensor was saturated, or else 0",
        _ if column.contains('_') => "give an angle in degrees",
        _ => "leave it empty if nothing was read",
    }
}

/// Returns the line of a row. The reader's `position` may be at empty lines before the row, which are skipped.
fn line_number(bytes: &[u8], position: Option<&Position>) -> u64 {
    let Some(position) = position else {
        return 1;
    };
    let offset = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = bytes.get(offset..).unwrap_or_default();
    let line_ends = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    position.line() + line_ends.filter(|byte| **byte == b'\n').count() as u64
}

/// Returns an error message if the first line does not name columns separated by commas.
fn separator_error(header: &StringRecord) -> Option<String> {
    let only_name = match header.len() {
        0 => "",
        1 => header.get(0).unwrap_or_default(),
        _ => return None,
    };
    let separator = match only_name {
        "" => {
            return Some("line 1 is empty; name the columns, separated by commas".to_owned());
        }
        _ if only_name.contains(';') => "semicolons",
        _ if only_name.contains('\t') => "tabs",
        _ => return None,
    };
    Some(format!(
        "its columns are separated by {separator}; save it with commas as separators and with decimal points"
    ))
}

/// Returns the message of a CSV syntax error.
fn csv_error_message(error: &csv::Error, line: u64) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!(
            "line {line} has {len} cells, but line 1 names {expected_len} columns; give every row {expected_len} \
             cells, and use decimal points instead of commas"
        ),
        csv::ErrorKind::Utf8 { .. } => format!("line {line} is not UTF-8; save the file as UTF-8"),
        _ => format!("line {line} cannot be parsed as CSV: {error}; correct the line"),
    }
}
