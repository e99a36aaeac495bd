//! A table in a text file, such as CSV. One line names the columns, in any order.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::ValueEnum;
use csv::{Position, StringRecord};
use glimpse_materials::untrusted::{escaped, escaped_start, read_at_most};
use serde::{Deserialize, Serialize};

use super::cells::{MARKS, decode_latin, plain, with_point};
use super::layout::{ANGLES, Layout, Unit, reader, tabulated, wavelength};
use super::names::{KnownName, is_same};

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

/// A table: the column names in lowercase, and the rows. Numbers have decimal points.
pub(super) struct Table {
    path: PathBuf,
    pub(super) layout: Layout,
    /// All rows below the names.
    pub(super) rows: Vec<Row>,
}

/// A reason to leave a row out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LeftOutRow {
    /// The row states that it is invalid.
    Invalid,
    /// The row states that it has a BTDF.
    Btdf,
    /// The sensor is below the horizon, and the light is not.
    SensorBelowHorizon,
}

/// A row and the line of the file on which it begins.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) line: usize,
    pub(super) cells: StringRecord,
    /// The reason to leave the row out.
    pub(super) left_out: Option<LeftOutRow>,
}

impl Table {
    /// Reads a whole file, without the columns of the names `ignored`. Columns are separated by commas, semicolons, tabs or
    /// spaces. Comments, empty rows, and empty cells at the end of a row are skipped.
    pub(super) fn read(path: &Path, ignored: &[String]) -> Result<Self, TableError> {
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
        for (label, name) in layout.labels.iter().zip(&mut layout.names) {
            if ignored.iter().any(|ignored| is_same(label, ignored)) {
                name.clear();
            }
        }
        let (line_of_names, count) = (layout.line, layout.names.len());
        let is_known = |name: &str| KnownName::find(name).is_some_and(|known| known.is_unique());
        for (index, name) in layout.names.iter().enumerate() {
            if is_known(name) && layout.names[..index].contains(name) {
                return Err(format!(
                    "line {line_of_names} names two columns {name}; remove or rename one"
                ));
            }
        }
        let below_names = text.splitn(line_of_names + 1, '\n').nth(line_of_names);
        let separator = layout.separator;
        let text = tabulated(below_names.unwrap_or_default(), separator);
        let mut table = Self {
            path: path.into(),
            layout,
            rows: Vec::new(),
        };
        for record in reader(&text, separator).records() {
            let record = record.map_err(|error| error.to_string())?;
            let line = line_of_names + line_number(&text, record.position());
            if record.iter().any(|cell| cell.contains('\n')) {
                return Err(format!(
                    "line {line} has a quotation mark that is not closed; remove it"
                ));
            }
            let cells: Vec<&str> = record.iter().collect();
            let last = cells.iter().rposition(|cell| !cell.is_empty());
            let used = last.map_or(0, |last| last + 1);
            // Spreadsheets write errors such as `#DIV/0!`.
            let first = cells.first().copied().unwrap_or_default();
            let is_error = first.ends_with(['!', '?']) || first == "#N/A";
            if used == 0 || first.starts_with('#') && !is_error {
                continue;
            }
            if used > count || cells.len() < count {
                return Err(format!(
                    "line {line} has {} cells, but line {line_of_names} names {count} columns; give every row {count} \
                     cells, and use decimal points instead of commas",
                    used.max(cells.len().min(count)),
                ));
            }
            let cells = &cells[..count];
            if !table.rows.is_empty() || !table.layout.add_units(line, cells) {
                let cells = cells.into();
                table.rows.push(Row {
                    line,
                    cells,
                    left_out: None,
                });
            }
        }
        table.read_numbers()?;
        Ok(table)
    }

    /// Writes the numbers in cells with decimal points, if one reading of their commas and points is possible.
    fn read_numbers(&mut self) -> Result<(), String> {
        let names = &self.layout.names;
        let has_numbers = |name: &String| {
            wavelength(name).is_some()
                || KnownName::find(name).is_some_and(|known| known.has_numbers())
        };
        let columns: Vec<bool> = names.iter().map(has_numbers).collect();
        // The first cell with two readings, and the first one that contradicts each mark of decimals.
        let (mut ambiguous, mut contradiction) = (None, [None; 2]);
        let mut has_commas = self.layout.separator == ';';
        for (index, row) in self.rows.iter_mut().enumerate() {
            let cells = row.cells.iter().zip(&columns);
            let cells = cells.map(|(cell, is_number)| {
                if *is_number {
                    plain(cell)
                } else {
                    cell.to_owned()
                }
            });
            let units = names
                .iter()
                .zip(&row.cells)
                .filter(|(_, cell)| cell.ends_with(['°', 'º']));
            for (name, _) in units {
                if self.layout.units.iter().all(|unit| unit.column != *name) {
                    self.layout.units.extend(Unit::new(row.line, name, "°"));
                }
            }
            row.cells = cells.collect();
            for (column, cell) in row
                .cells
                .iter()
                .enumerate()
                .filter(|(column, _)| columns[*column])
            {
                let is_angle = ANGLES.contains(&&names[column][..]);
                let numbers = MARKS.map(|mark| {
                    with_point(cell, mark).filter(|number| {
                        !is_angle || number.parse().is_ok_and(|angle: f64| angle < 1e3)
                    })
                });
                if !cell.contains(['.', ',']) || numbers.iter().all(Option::is_none) {
                    continue;
                }
                has_commas |= cell.contains(',');
                for (contradiction, number) in contradiction.iter_mut().zip(&numbers) {
                    if number.is_none() {
                        *contradiction = contradiction.or(Some((index, column)));
                    }
                }
                if numbers[0] != numbers[1] {
                    ambiguous = ambiguous.or(Some((index, column)));
                }
            }
        }
        let (mark, defect) = match contradiction {
            _ if !has_commas => return Ok(()),
            [None, None] => (MARKS[0], ambiguous),
            [None, Some(_)] => (MARKS[0], None),
            [Some(_), None] => (MARKS[1], None),
            // With commas for both, the first cell with a comma.
            [Some(one), Some(other)] => (
                MARKS[0],
                Some(if self.rows[one.0].cells[one.1].contains(',') {
                    one
                } else {
                    other
                }),
            ),
        };
        if let Some((row, column)) = defect {
            let (row, name) = (&self.rows[row], &names[column]);
            return Err(format!(
                "line {}, column {name}: the mark of `{}` may separate decimals or thousands; write all numbers with decimal \
                 points, and without separators of thousands",
                row.line,
                escaped(&row.cells[column])
            ));
        }
        for row in &mut self.rows {
            let cells = row.cells.iter().zip(&columns);
            let number = |(cell, is_number): (&str, &bool)| {
                let number = with_point(cell, mark).filter(|_| *is_number);
                number.unwrap_or_else(|| cell.to_owned())
            };
            row.cells = cells.map(number).collect();
        }
        Ok(())
    }

    /// Returns true if the option `--ignore` names the column.
    pub(super) fn is_ignored(&self, column: usize) -> bool {
        self.layout.names[column].is_empty() && !self.layout.labels[column].is_empty()
    }

    /// Returns a table for each text of a column, with the text. None if the table lacks the column.
    pub(super) fn split(self, column: &str) -> Option<Vec<(String, Self)>> {
        let index = self
            .layout
            .labels
            .iter()
            .position(|label| is_same(label, column))?;
        let mut tables: Vec<(String, Self)> = Vec::new();
        let mut known: HashMap<String, usize> = HashMap::new();
        for row in self.rows {
            let text = row.cells[index].to_owned();
            let table = *known.entry(text.clone()).or_insert(tables.len());
            if table == tables.len() {
                let (path, layout) = (self.path.clone(), self.layout.clone());
                tables.push((
                    text,
                    Self {
                        path,
                        layout,
                        rows: Vec::new(),
                    },
                ));
            }
            tables[table].1.rows.push(row);
        }
        Some(tables)
    }

    /// Returns the names and the wavelengths in nm of the columns of bands, in ascending order of wavelengths.
    pub(super) fn bands(&self) -> Vec<(String, f32)> {
        let names = self.layout.names.iter();
        let bands = names.filter_map(|name| Some((name.to_owned(), wavelength(name)?)));
        let mut bands: Vec<(String, f32)> = bands.collect();
        bands.sort_by(|(_, one), (_, other)| one.total_cmp(other));
        bands
    }

    /// Returns true if the table has all columns with these names.
    pub(super) fn has(&self, names: &[&str]) -> bool {
        let has = |name: &&str| self.layout.names.iter().any(|column| column == name);
        names.iter().all(has)
    }

    /// Returns the text of a cell; empty if the column does not exist.
    pub(super) fn cell<'a>(&self, row: &'a Row, column: &str) -> &'a str {
        let index = self.layout.names.iter().position(|name| name == column);
        index.map_or("", |index| &row.cells[index])
    }

    /// Parses the number in a cell; None if the cell is empty or the column does not exist. `remedy` ends the error about
    /// another text.
    pub(super) fn number<T: FromStr>(
        &self,
        row: &Row,
        column: &str,
        remedy: &str,
    ) -> Result<Option<T>, TableError> {
        let cell = self.cell(row, column);
        if cell.is_empty() {
            return Ok(None);
        }
        cell.parse().map(Some).map_err(|_| {
            let cell = escaped(cell);
            let message = format!("column {column}: `{cell}` is not a valid number; {remedy}");
            self.line_error(row.line, &message)
        })
    }

    /// Returns an error that concerns the columns.
    pub(super) fn columns_error(&self, defect: &str) -> TableError {
        let names = escaped(&self.layout.labels.join(", "));
        let line = self.layout.line;
        self.file_error(format!("line {line} names the columns {names}, {defect}"))
    }

    /// Returns an error that concerns the whole file.
    pub(super) fn file_error(&self, message: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            message,
        }
    }

    /// Returns an error that concerns one line; `message` may begin with the column.
    pub(super) fn line_error(&self, line: usize, message: &str) -> TableError {
        self.file_error(format!("line {line}, {message}"))
    }
}

/// Returns the text of a file, in UTF-8 or Windows-1252, with `\n` at the end of each line. Spreadsheets and other files that
/// are not text have bytes that are 0 or not printable.
fn decode(bytes: &[u8]) -> Result<String, String> {
    let unified = |text: &str| text.replace("\r\n", "\n").replace('\r', "\n");
    let text = str::from_utf8(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    if let (Err(_), Some(text)) = (&text, decode_latin(bytes)) {
        return Ok(unified(&text));
    }
    let valid = match (text, bytes.iter().position(|byte| *byte == 0)) {
        (Ok(text), None) => return Ok(unified(text)),
        (Err(error), None) => error.valid_up_to(),
        (_, Some(position)) => position,
    };
    let line = 1 + bytes[..valid].iter().filter(|byte| **byte == b'\n').count();
    let start = escaped_start(bytes);
    Err(format!(
        "line {line} is not text in UTF-8, and the file starts with `{start}`; save it as CSV in UTF-8"
    ))
}

/// Returns the line of a row. The reader's `position` may be at empty lines before the row, which are skipped.
fn line_number(text: &str, position: Option<&Position>) -> usize {
    let (byte, line) = position.map_or((0, 1), |position| (position.byte(), position.line()));
    let rest = text.as_bytes().get(byte as usize..).unwrap_or_default();
    line as usize + rest.iter().take_while(|byte| **byte == b'\n').count()
}
