//! A table in a text file, such as CSV. One line names the columns, in any order.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use csv::{Position, StringRecord};
use glimpse_materials::untrusted::{escaped, read_at_most};
use serde::{Deserialize, Serialize};

use super::cells::{MARKS, decode, plain, with_point};
use super::columns::{Column, Role, Unit, is_same};
use super::layout::{Layout, reader, single_spaced};

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
}

/// A table: the columns, and the rows. Numbers have decimal points.
pub(crate) struct Table {
    path: PathBuf,
    pub(crate) layout: Layout,
    /// All rows below the names.
    pub(crate) rows: Vec<Row>,
}

/// A reason to leave a row out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LeftOutRow {
    /// The row states that it is invalid.
    Invalid,
    /// The row states that it has a BTDF.
    Btdf,
    /// The sensor is below the horizon, and the light is not.
    SensorBelowHorizon,
}

/// The state of a row by its own columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Mark {
    Kept,
    Saturated,
    LeftOut(LeftOutRow),
}

/// A row and the line of the file on which it begins.
#[derive(Clone)]
pub(crate) struct Row {
    pub(crate) line: usize,
    pub(super) cells: StringRecord,
    pub(super) mark: Mark,
}

impl Table {
    /// Reads a whole file, without the columns of the names `ignored`. Columns are separated by commas, semicolons, tabs or
    /// spaces. Comments, empty rows, and empty cells at the end of a row are skipped.
    pub(crate) fn read(path: &Path, ignored: &[String]) -> Result<Self, TableError> {
        let bytes = read_at_most(path, MAX_BYTES).map_err(|source| TableError::Read {
            path: path.into(),
            source,
        })?;
        Self::parse_text(path, &bytes, ignored).map_err(|message| TableError::Damaged {
            path: path.into(),
            message,
        })
    }

    fn parse_text(path: &Path, bytes: &[u8], ignored: &[String]) -> Result<Self, String> {
        let text = decode(bytes)?;
        let mut layout = Layout::find(&text)?;
        for column in &mut layout.columns {
            if ignored.iter().any(|name| is_same(&column.label, name)) {
                column.role = Some(Role::Ignored);
                column.name.clear();
            }
        }
        let (line_of_names, count, separator) =
            (layout.line, layout.columns.len(), layout.separator);
        for (index, Column { name, .. }) in layout.columns.iter().enumerate() {
            let mut others = layout.columns[..index].iter();
            if others.any(|other| other.is_unique() && other.name == *name) {
                return Err(format!(
                    "line {line_of_names} names two columns {name}; remove or rename one"
                ));
            }
        }
        let below_names = text.splitn(line_of_names + 1, '\n').nth(line_of_names);
        let text = single_spaced(below_names.unwrap_or_default(), separator);
        let mut rows = Vec::new();
        for record in reader(&text, separator).records() {
            let record = record.map_err(|error| error.to_string())?;
            let line = line_of_names + line_number(&text, record.position());
            if record.iter().any(|cell| cell.contains('\n')) {
                return Err(format!(
                    "line {line} has a quotation mark that is not closed; remove it"
                ));
            }
            let last = (0..record.len()).rfind(|index| !record[*index].is_empty());
            let used = last.map_or(0, |last| last + 1);
            // Spreadsheets write errors such as `#DIV/0!`.
            let first = record.get(0).unwrap_or_default();
            let is_error = first.ends_with(['!', '?']) || first == "#N/A";
            if used == 0 || first.starts_with('#') && !is_error {
                continue;
            }
            if used > count || record.len() < count {
                return Err(format!(
                    "line {line} has {} cells, but line {line_of_names} names {count} columns; give every row {count} \
                     cells, and use decimal points instead of commas",
                    used.max(record.len().min(count)),
                ));
            }
            let cells: Vec<&str> = record.iter().take(count).collect();
            if !rows.is_empty() || !layout.add_units(line, &cells) {
                let (cells, mark) = (cells.into(), Mark::Kept);
                rows.push(Row { line, cells, mark });
            }
        }
        let mut table = Self {
            path: path.into(),
            layout,
            rows,
        };
        table.read_numbers()?;
        Ok(table)
    }

    /// Writes the numbers in cells with decimal points, if one reading of their commas and points is possible.
    fn read_numbers(&mut self) -> Result<(), String> {
        self.map_numbers(plain);
        let numbers = self.rows.iter().flat_map(|row| {
            let cells = self.layout.columns.iter().zip(&row.cells);
            let numbers = cells.filter(|(column, _)| column.has_numbers());
            numbers.map(move |(column, cell)| (row.line, column, cell))
        });
        let has_comma = |(_, _, cell): &(usize, &Column, &str)| cell.contains(',');
        let has_commas = self.layout.separator == ';' || numbers.clone().any(|one| has_comma(&one));
        // Angles are below 1000.
        let with_mark = |(_, column, cell): &(usize, &Column, &str), mark: usize| {
            let number = with_point(cell, MARKS[mark]);
            let is_angle = column.role == Some(Role::Direction);
            number.filter(|number| !is_angle || number.parse().is_ok_and(|angle: f64| angle < 1e3))
        };
        // The first number that contradicts each mark of decimals.
        let [no_point, no_comma] = [0, 1].map(|mark| {
            let mut numbers = numbers.clone().filter(|_| has_commas);
            numbers.find(|one| with_mark(one, mark).is_none() && with_mark(one, 1 - mark).is_some())
        });
        let mut ambiguous = numbers.filter(|one| with_mark(one, 0) != with_mark(one, 1));
        let defect = match (no_point, no_comma) {
            (None, None) if has_commas => ambiguous.next(),
            (Some(one), Some(other)) => Some(if has_comma(&one) { one } else { other }),
            _ => None,
        };
        if let Some((line, column, cell)) = defect {
            return Err(format!(
                "line {line}, column {}: the mark of `{}` may separate decimals or thousands; write all numbers with decimal \
                 points, and without separators of thousands",
                column.name,
                escaped(cell)
            ));
        }
        let mark = MARKS[usize::from(no_point.is_some())];
        self.map_numbers(|cell| with_point(cell, mark).unwrap_or_else(|| cell.to_owned()));
        Ok(())
    }

    /// Replaces the cells of columns with numbers.
    fn map_numbers(&mut self, write: impl Fn(&str) -> String) {
        for row in &mut self.rows {
            let cells = self.layout.columns.iter().zip(&row.cells);
            let written = cells.map(|(column, cell)| {
                let number = Some(cell).filter(|_| column.has_numbers());
                number.map_or_else(|| cell.to_owned(), &write)
            });
            row.cells = written.collect();
        }
    }

    /// Returns a table for each text of a column, with the text, in alphabetical order.
    ///
    /// # Errors
    /// If the table lacks the column.
    pub(super) fn split(mut self, name: &str) -> Result<Vec<(String, Self)>, TableError> {
        let mut columns = self.layout.columns.iter();
        let index = columns.position(|column| is_same(&column.label, name));
        let index = index.ok_or_else(|| {
            let name = escaped(name);
            self.columns_error(&format!("not {name}; correct --by, or remove it"))
        })?;
        let text = |row: &Row| row.cells[index].to_owned();
        self.rows.sort_by_cached_key(text);
        let groups = self
            .rows
            .chunk_by(|one, other| one.cells[index] == other.cells[index]);
        let table = |rows: &[Row]| {
            let table = Self {
                path: self.path.clone(),
                layout: self.layout.clone(),
                rows: rows.to_vec(),
            };
            (text(&rows[0]), table)
        };
        Ok(groups.map(table).collect())
    }

    /// Returns true if the table has all columns with these names.
    pub(crate) fn has(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.layout.index(name).is_some())
    }

    /// Returns the text of a cell; empty if the column does not exist.
    pub(crate) fn cell<'a>(&self, row: &'a Row, name: &str) -> &'a str {
        self.layout
            .index(name)
            .map_or("", |index| &row.cells[index])
    }

    /// Returns the number in a cell; None if the cell is empty or the column does not exist. `remedy` ends the error about
    /// a number that is not valid, or another text.
    pub(super) fn number(
        &self,
        row: &Row,
        name: &str,
        is_valid: impl Fn(&f64) -> bool,
        remedy: &str,
    ) -> Result<Option<f64>, TableError> {
        let cell = self.cell(row, name);
        let number = cell.parse().ok().filter(is_valid);
        if number.is_some() || cell.is_empty() {
            return Ok(number);
        }
        let cell = escaped(cell);
        let message = format!("column {name}: `{cell}` is not valid; {remedy}");
        Err(self.line_error(row.line, &message))
    }

    /// Returns the numbers in cells; none if all of them are empty.
    pub(crate) fn numbers(
        &self,
        row: &Row,
        names: &[&str],
        is_valid: fn(&f64) -> bool,
        remedy: &str,
    ) -> Result<Vec<f64>, TableError> {
        let numbers = names
            .iter()
            .map(|name| self.number(row, name, is_valid, remedy));
        let numbers: Vec<Option<f64>> = numbers.collect::<Result<_, _>>()?;
        if let Some(empty) = numbers.iter().position(Option::is_none)
            && numbers.iter().any(Option::is_some)
        {
            let (name, count) = (names[empty], names.len());
            let message = format!(
                "column {name}: it is empty, but others are not; give all {count}, or none"
            );
            return Err(self.line_error(row.line, &message));
        }
        Ok(numbers.into_iter().flatten().collect())
    }

    /// Returns the stated unit of a column; None if there is none, or the column does not exist.
    ///
    /// # Errors
    /// If a unit is unknown, or differs from another one of the column.
    pub(super) fn unit(&self, name: &str) -> Result<Option<Unit>, TableError> {
        let mut stated = None;
        let Some(index) = self.layout.index(name) else {
            return Ok(None);
        };
        let column = &self.layout.columns[index];
        for (line, text) in &column.units {
            let unit = column.role.and_then(|role| Unit::find(role, text));
            if unit.is_none() || stated.is_some() && stated != unit {
                return Err(self.unit_error(*line, column, text));
            }
            stated = unit;
        }
        Ok(stated)
    }

    /// Returns an error that concerns a unit.
    pub(super) fn unit_error(&self, line: usize, column: &Column, text: &str) -> TableError {
        let (name, text) = (&column.name, escaped(text));
        let message = format!(
            "column {name}: its unit is `{text}`, which is unknown or differs from another one; give deg or rad for angles, 1/sr, \
             % or counts for all readings, % for noise, ms or s for exposures, nm or um for wavelengths, or no unit and the \
             quantity of the readings as an option (for counts per time, --white in the same unit, both without dark counts)"
        );
        self.line_error(line, &message)
    }

    /// Returns an error that concerns the columns.
    pub(crate) fn columns_error(&self, defect: &str) -> TableError {
        let labels = self.layout.columns.iter().map(|column| &column.label[..]);
        let names = escaped(&labels.collect::<Vec<_>>().join(", "));
        let line = self.layout.line;
        self.file_error(format!("line {line} names the columns {names}, {defect}"))
    }

    /// Returns an error that concerns the whole file.
    pub(crate) fn file_error(&self, message: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            message,
        }
    }

    /// Returns an error that concerns one line; `message` may begin with the column.
    pub(crate) fn line_error(&self, line: usize, message: &str) -> TableError {
        self.file_error(format!("line {line}, {message}"))
    }
}

/// Returns the line of a row. The reader's `position` may be at empty lines before the row, which are skipped.
fn line_number(text: &str, position: Option<&Position>) -> usize {
    let (byte, line) = position.map_or((0, 1), |position| (position.byte(), position.line()));
    let rest = text.as_bytes().get(byte as usize..).unwrap_or_default();
    line as usize + rest.iter().take_while(|byte| **byte == b'\n').count()
}
