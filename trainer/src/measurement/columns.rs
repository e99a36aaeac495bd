//! Columns of a table of readings, and parsing of their cells.

use glimpse_materials::untrusted::escaped;

use super::angles::{AngleColumns, INDEX, RowAngles};
use super::table::{Row, Table, TableError};

/// The columns of readings by a sensor with three channels.
const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of readings by a sensor with one channel.
const MONOCHROME: &str = "value";

/// One parsed row of readings.
pub(super) struct ReadingRow {
    /// The line of the file, or the index of the reading in an array, from 0.
    pub(super) line: u64,
    pub(super) index: Option<usize>,
    pub(super) angles: Option<RowAngles>,
    /// None if the cells are empty: nothing was read.
    pub(super) values: Option<[f32; 3]>,
    pub(super) saturated: bool,
    /// The lowercase name in the column `quantity`; empty if there is none.
    pub(super) quantity: String,
}

/// The indices and names of the columns.
pub(super) struct Columns {
    index: Option<usize>,
    angles: Option<AngleColumns>,
    values: [usize; 3],
    names: [&'static str; 3],
    saturated: Option<usize>,
    quantity: Option<usize>,
}

impl Columns {
    /// Finds the columns of a table.
    pub(super) fn find(table: &Table) -> Result<Self, TableError> {
        let index = table.column(INDEX)?;
        let angles = AngleColumns::find(table)?;
        if index.is_none() && angles.is_none() {
            return Err(table.file_error(format!(
                "line 1 names the columns {}, which do not identify the sample of a reading; add theta_h, theta_d, \
                 phi_d, or theta_i, phi_i, theta_o, phi_o (degrees), or index (the sample's number, from 0)",
                table.names()
            )));
        }
        let (values, names) = match (table.columns(CHANNELS)?, table.column(MONOCHROME)?) {
            (Some(columns), None) => (columns, CHANNELS),
            (None, Some(column)) => ([column; 3], [MONOCHROME; 3]),
            (Some(_), Some(_)) => {
                return Err(table.file_error(
                    "it has both the columns r, g, b and value; remove or rename one set"
                        .to_owned(),
                ));
            }
            (None, None) => {
                return Err(table.file_error(format!(
                    "line 1 names the columns {}, none of which holds readings; add r, g, b, or value for a sensor with \
                     one channel",
                    table.names()
                )));
            }
        };
        Ok(Self {
            index,
            angles,
            values,
            names,
            saturated: table.column("saturated")?,
            quantity: table.column("quantity")?,
        })
    }

    /// Parses a row. The error describes the invalid cell.
    pub(super) fn parse(&self, row: &Row) -> Result<ReadingRow, String> {
        let index = self.index.map(|column| row.cell(column));
        let index = index.filter(|cell| !cell.is_empty()).map(|cell| {
            // Some programs write whole numbers as 3.0.
            cell.strip_suffix(".0")
                .unwrap_or(cell)
                .parse()
                .map_err(|_| {
                    format!(
                        "column index: `{}` is not a sample's number; give 0, 1, 2, ...",
                        escaped(cell)
                    )
                })
        });
        let index = index.transpose()?;
        let angles = match &self.angles {
            // A row with an index may leave its angles empty.
            Some(columns) if index.is_none() || !columns.are_empty(row) => {
                Some(columns.parse(row)?)
            }
            _ => None,
        };
        if index.is_none() && angles.is_none() {
            return Err("column index: it is empty; give the sample's number, from 0".to_owned());
        }
        Ok(ReadingRow {
            line: row.line,
            index,
            angles,
            values: self.values(row)?,
            saturated: self.saturated(row)?,
            quantity: self.quantity(row),
        })
    }

    fn values(&self, row: &Row) -> Result<Option<[f32; 3]>, String> {
        let mut values = [0.0_f32; 3];
        let mut absent = [false; 3];
        for channel in 0..3 {
            let (cell, name) = (row.cell(self.values[channel]), self.names[channel]);
            // Programs write a missing value as an empty cell or as NaN.
            absent[channel] = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
            if absent[channel] {
                continue;
            }
            values[channel] = cell.parse().map_err(|_| {
                format!(
                    "column {name}: `{}` is not a number; leave it empty if nothing was read",
                    escaped(cell)
                )
            })?;
            if !values[channel].is_finite() {
                return Err(format!(
                    "column {name}: {} is not finite; leave it empty if nothing was read",
                    escaped(cell)
                ));
            }
        }
        match absent {
            [false, false, false] => Ok(Some(values)),
            [true, true, true] => Ok(None),
            _ => {
                let missing = absent.iter().position(|absent| *absent).unwrap_or_default();
                Err(format!(
                    "column {}: it is empty but the other channels are not; give all three, or none if nothing was \
                     read",
                    self.names[missing]
                ))
            }
        }
    }

    fn quantity(&self, row: &Row) -> String {
        let cell = self.quantity.map_or("", |column| row.cell(column));
        match cell.to_lowercase() {
            // An alias of ASTM's quantity, which the options accept as well.
            alias if alias == "brdf-cos" => "brdf-cos-o".to_owned(),
            name => name,
        }
    }

    fn saturated(&self, row: &Row) -> Result<bool, String> {
        match self.saturated.map_or("", |column| row.cell(column)) {
            "" | "0" => Ok(false),
            "1" => Ok(true),
            cell => Err(format!(
                "column saturated: `{}` is neither 0 nor 1; give 1 if the sensor was saturated",
                escaped(cell)
            )),
        }
    }
}
