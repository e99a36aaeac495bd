//! Columns of readings, and what stands in them.

use glimpse_materials::untrusted::escaped;

use super::angles::{AngleColumns, Given, INDEX};
use super::table::{Row, Table, TableError};

/// The columns of a sensor with three channels.
const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of a sensor with one.
const MONOCHROME: &str = "value";

/// A row: where, as far as it says so, and what.
pub(super) struct ReadRow {
    /// The line of a file, or the row of an array, from 0.
    pub(super) line: u64,
    pub(super) index: Option<usize>,
    pub(super) given: Option<Given>,
    /// None where the cells are empty: nothing was read.
    pub(super) values: Option<[f32; 3]>,
    pub(super) saturated: bool,
    /// What the row says that its numbers are; empty if it does not.
    pub(super) quantity: String,
}

/// Where the columns are.
pub(super) struct Columns {
    index: Option<usize>,
    angles: Option<AngleColumns>,
    values: [usize; 3],
    names: [&'static str; 3],
    saturated: Option<usize>,
    quantity: Option<usize>,
}

impl Columns {
    pub(super) fn of(table: &Table) -> Result<Self, TableError> {
        let index = table.column(INDEX)?;
        let angles = AngleColumns::of(table)?;
        if index.is_none() && angles.is_none() {
            return Err(table.damaged(format!(
                "its first line should say where each reading was taken: theta_h, theta_d, phi_d, \
                 or theta_i, phi_i, theta_o, phi_o (degrees), or index (the sample's number, from \
                 0), and names {}; correct it",
                table.names()
            )));
        }
        let (values, names) = match (table.columns(CHANNELS)?, table.column(MONOCHROME)?) {
            (Some(columns), None) => (columns, CHANNELS),
            (None, Some(column)) => ([column; 3], [MONOCHROME; 3]),
            (Some(_), Some(_)) => {
                return Err(table.damaged(
                    "it has columns r, g, b as well as value; remove or rename what is not meant"
                        .to_owned(),
                ));
            }
            (None, None) => {
                return Err(table.damaged(format!(
                    "its first line should name what was read: r, g, b, or value of a sensor with \
                     one channel, and names {}; correct it",
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

    /// A row; or what is wrong with one of its cells.
    pub(super) fn row(&self, row: &Row) -> Result<ReadRow, String> {
        let index = self.index.map(|column| row.cell(column));
        let index = index.filter(|cell| !cell.is_empty()).map(|cell| {
            // Programs write whole numbers as 3.0, too.
            cell.strip_suffix(".0")
                .unwrap_or(cell)
                .parse()
                .map_err(|_| {
                    let shown = escaped(cell);
                    format!("column index: `{shown}` is no sample's number; give 0, 1, 2, ...")
                })
        });
        let index = index.transpose()?;
        let given = match &self.angles {
            // A row that says which sample it is of may leave its angles out.
            Some(columns) if index.is_none() || !columns.are_empty(row) => {
                Some(columns.given(row)?)
            }
            _ => None,
        };
        if index.is_none() && given.is_none() {
            return Err("column index: it is empty; give the sample's number, from 0".to_owned());
        }
        Ok(ReadRow {
            line: row.line,
            index,
            given,
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
            // Programs write what is not there as either.
            absent[channel] = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
            if absent[channel] {
                continue;
            }
            values[channel] = cell.parse().map_err(|_| {
                format!(
                    "column {name}: `{}` is no number; leave it empty if nothing was read",
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
                    "column {}: it is empty while the others are not; give all three, or none if \
                     nothing was read",
                    self.names[missing]
                ))
            }
        }
    }

    fn quantity(&self, row: &Row) -> String {
        let cell = self.quantity.map_or("", |column| row.cell(column));
        match cell.to_lowercase() {
            // ASTM's, which options may call so too.
            short if short == "brdf-cos" => "brdf-cos-o".to_owned(),
            name => name,
        }
    }

    fn saturated(&self, row: &Row) -> Result<bool, String> {
        match self.saturated.map_or("", |column| row.cell(column)) {
            "" | "0" => Ok(false),
            "1" => Ok(true),
            cell => Err(format!(
                "column saturated: `{}` is neither 0 nor 1; give 1 where the sensor was at its end",
                escaped(cell)
            )),
        }
    }
}
