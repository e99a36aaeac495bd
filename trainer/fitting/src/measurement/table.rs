//! A table in a text file, such as CSV. One line names the columns, in any order.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use csv::{Position, StringRecord};
use glimpse_materials::untrusted::{escaped, escaped_start, read_at_most};

use super::layout::{
    AngleUnit, DEGREES, Layout, PER_STERADIAN, RADIANS, Unit, is_known, is_number, is_value,
    may_separate_thousands, reader, tabulated, wavelength,
};

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

/// A row and the line of the file on which it begins.
pub(super) struct Row {
    pub(super) line: usize,
    cells: StringRecord,
}

impl Table {
    /// Reads a whole file. Columns are separated by commas, semicolons, tabs or spaces. Comments, empty rows, and empty
    /// cells at the end of a row are ignored.
    pub(super) fn read(path: &Path) -> Result<Self, TableError> {
        let bytes = read_at_most(path, MAX_BYTES).map_err(|source| TableError::Read {
            path: path.into(),
            source,
        })?;
        Self::parse_text(path, &bytes).map_err(|message| TableError::Damaged {
            path: path.into(),
            message,
        })
    }

    fn parse_text(path: &Path, bytes: &[u8]) -> Result<Self, String> {
        let text = decode(bytes)?;
        let layout = Layout::find(&text)?;
        let (line_of_names, count) = (layout.line, layout.names.len());
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
                table.rows.push(Row { line, cells });
            }
        }
        table.replace_decimal_commas()?;
        Ok(table)
    }

    /// Replaces decimal commas by decimal points, if no comma can separate thousands.
    fn replace_decimal_commas(&mut self) -> Result<(), String> {
        let names = &self.layout.names;
        let columns: Vec<usize> = (0..names.len())
            .filter(|column| is_number(&names[*column]))
            .collect();
        let find = |condition: fn(&str) -> bool| {
            let mut cells = self
                .rows
                .iter()
                .flat_map(|row| columns.iter().map(move |column| (row, *column)));
            cells.find(|(row, column)| condition(&row.cells[*column]))
        };
        let Some((row, column)) = find(|cell| cell.contains(',')) else {
            return Ok(());
        };
        let has_points = find(|cell| cell.contains('.') && cell.parse::<f64>().is_ok()).is_some();
        let is_decimal = find(|cell| cell.contains(',') && !may_separate_thousands(cell)).is_some();
        if has_points || !is_decimal {
            return Err(format!(
                "line {}, column {}: the comma of `{}` may separate decimals or thousands; write all numbers with \
                 decimal points, and without separators of thousands",
                row.line,
                names[column],
                escaped(&row.cells[column])
            ));
        }
        for row in &mut self.rows {
            let cells = row.cells.iter().enumerate().map(|(column, cell)| {
                let number = cell.replacen(',', ".", 1);
                let is_decimal = columns.contains(&column) && number.parse::<f64>().is_ok();
                if is_decimal { number } else { cell.to_owned() }
            });
            row.cells = cells.collect();
        }
        Ok(())
    }

    /// Returns the stated unit of the angles in these columns: DEGREES or RADIANS.
    ///
    /// # Errors
    /// If a unit is unknown, or differs from another one.
    pub(super) fn angle_unit(&self, columns: &[&str]) -> Result<Option<AngleUnit>, TableError> {
        let mut stated = None;
        let units = self.layout.units.iter();
        for unit in units.filter(|unit| columns.contains(&&unit.column[..])) {
            let angle_unit = match &unit.text[..] {
                text if DEGREES.contains(&text) => AngleUnit::Degrees,
                text if RADIANS.contains(&text) => AngleUnit::Radians,
                _ => return Err(self.unit_error(unit, "deg or rad")),
            };
            if *stated.get_or_insert(angle_unit) != angle_unit {
                return Err(self.unit_error(unit, "the same unit in all columns"));
            }
        }
        Ok(stated)
    }

    /// Checks that the stated units of readings are those of a BRDF, or none.
    pub(super) fn check_value_units(&self) -> Result<(), TableError> {
        let units = self.layout.units.iter();
        for unit in units.filter(|unit| is_value(&unit.column)) {
            let text = &unit.text[..];
            let is_wavelength = text == "nm" && wavelength(&unit.column).is_some();
            if !PER_STERADIAN.contains(&text) && !["1", "-"].contains(&text) && !is_wavelength {
                let remedy = "1/sr, or no unit and the quantity of the readings as an option";
                return Err(self.unit_error(unit, remedy));
            }
        }
        Ok(())
    }

    fn unit_error(&self, Unit { line, column, text }: &Unit, remedy: &str) -> TableError {
        let text = escaped(text);
        let message = format!("column {column}: its unit is `{text}`; give {remedy}");
        self.line_error(*line, &message)
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
        let names = escaped(&self.layout.names.join(", "));
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

/// Returns the text of a file, with `\n` at the end of each line. Spreadsheets and other files that are not text have
/// bytes that are 0 or not UTF-8.
fn decode(bytes: &[u8]) -> Result<String, String> {
    let text = str::from_utf8(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let valid = match (text, bytes.iter().position(|byte| *byte == 0)) {
        (Ok(text), None) => return Ok(text.replace("\r\n", "\n").replace('\r', "\n")),
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
