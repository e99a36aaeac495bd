//! A CSV file whose first line names its columns, in any order.

use std::path::{Path, PathBuf};

use csv::{Position, ReaderBuilder, StringRecord, Trim};
use glimpse_materials::untrusted::{escaped, read_at_most};

/// The longest file that is read: a million rows and more.
const MOST_BYTES: u64 = 1 << 28;

/// Why a file of measurements cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The operating system refuses.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is no table, or not one of what is expected.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Line and column, what is wrong there, and the remedy.
        what: String,
    },
}

/// A table: what its first line says, and its rows.
pub(super) struct Table {
    path: PathBuf,
    header: StringRecord,
    rows: Vec<Row>,
}

/// A row, and the line of the file on which it begins.
pub(super) struct Row {
    pub(super) line: u64,
    cells: StringRecord,
}

impl Row {
    /// The text of a cell.
    pub(super) fn cell(&self, column: usize) -> &str {
        self.cells.get(column).unwrap_or_default()
    }
}

impl Table {
    /// Reads a whole file.
    pub(super) fn read(path: &Path) -> Result<Self, TableError> {
        let bytes = read_at_most(path, MOST_BYTES).map_err(|source| TableError::Read {
            path: path.into(),
            source,
        })?;
        let damaged = |what| TableError::Damaged {
            path: path.into(),
            what,
        };
        let unreadable =
            |error: csv::Error| damaged(unreadable(&error, line(&bytes, error.position())));
        let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(&bytes[..]);
        let header = reader.headers().map_err(unreadable)?.clone();
        if let Some(what) = not_separated(&header) {
            return Err(damaged(what));
        }
        let rows = reader.records().map(|cells| {
            let cells = cells.map_err(unreadable)?;
            let line = line(&bytes, cells.position());
            Ok(Row { line, cells })
        });
        let rows = rows.collect::<Result<_, TableError>>()?;
        Ok(Self {
            path: path.into(),
            header,
            rows,
        })
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The names of all columns.
    pub(super) fn names(&self) -> String {
        escaped(&self.header.iter().collect::<Vec<_>>().join(", "))
    }

    /// All rows.
    pub(super) fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Where the column of a name is, if there is one.
    pub(super) fn column(&self, name: &str) -> Result<Option<usize>, TableError> {
        let mut places = self.header.iter().enumerate();
        let mut next = || places.find(|(_, found)| found.eq_ignore_ascii_case(name));
        let first = next().map(|(place, _)| place);
        match next() {
            None => Ok(first),
            Some(_) => {
                Err(self.damaged(format!("it has two columns {name}; remove or rename one")))
            }
        }
    }

    /// Where the columns of these names are; None if not all are there.
    pub(super) fn columns<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<Option<[usize; N]>, TableError> {
        let mut columns = [0; N];
        for (column, name) in columns.iter_mut().zip(names) {
            match self.column(name)? {
                Some(place) => *column = place,
                None => return Ok(None),
            }
        }
        Ok(Some(columns))
    }

    /// What becomes of something that is wrong with the whole file.
    pub(super) fn damaged(&self, what: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            what,
        }
    }

    /// What becomes of something that is wrong on a line; `what` may begin with the column.
    pub(super) fn wrong(&self, line: u64, what: &str) -> TableError {
        self.damaged(format!("line {line}, {what}"))
    }
}

/// The line of a row whose reading began at `position`, on empty lines before it perhaps.
fn line(bytes: &[u8], position: Option<&Position>) -> u64 {
    let Some(position) = position else {
        return 1;
    };
    let begin = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = bytes.get(begin..).unwrap_or_default();
    let ends = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    position.line() + ends.filter(|byte| **byte == b'\n').count() as u64
}

/// What is said of a first line that does not name columns with commas between them.
fn not_separated(header: &StringRecord) -> Option<String> {
    let only = match header.len() {
        0 => "",
        1 => header.get(0).unwrap_or_default(),
        _ => return None,
    };
    let separator = match only {
        "" => {
            return Some(
                "its first line is empty, and should name the columns; name them, with commas \
                 between them"
                    .to_owned(),
            );
        }
        only if only.contains(';') => "semicolons",
        only if only.contains('\t') => "tabs",
        _ => return None,
    };
    Some(format!(
        "its columns have {separator} between them; save it with commas, and with decimal points"
    ))
}

/// Says what is wrong with the file as CSV.
fn unreadable(error: &csv::Error, line: u64) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!(
            "line {line} has {len} cells where the first line names {expected_len}; give every \
             row as many, and numbers points instead of decimal commas"
        ),
        csv::ErrorKind::Utf8 { .. } => format!("line {line} is not UTF-8; save the file as that"),
        _ => format!("line {line} cannot be read: {error}"),
    }
}
