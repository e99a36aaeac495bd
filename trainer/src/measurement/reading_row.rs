//! One row of readings, from a file or an array.

use glimpse_materials::untrusted::escaped;
use serde::Deserialize;

use super::angles::{AngleColumns, INDEX, RowAngles};
use super::convention::AngleArgs;
use super::table::{Row, Table, TableError};

/// The columns of readings by a sensor with three channels.
const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of readings by a sensor with one channel.
const MONOCHROME: &str = "value";

/// One row of readings.
#[derive(Default)]
pub(super) struct ReadingRow {
    /// The line of the file, or the index of the reading in an array, from 0.
    pub(super) line: u64,
    pub(super) index: Option<usize>,
    pub(super) angles: Option<RowAngles>,
    /// None if the cells are empty: nothing was read.
    pub(super) values: Option<[f32; 3]>,
    pub(super) saturated: bool,
    /// The standard deviation of the noise, relative to the reading; None if it is not stated.
    pub(super) noise: Option<f32>,
    /// The lowercase name in the column `quantity`; empty if there is none.
    pub(super) quantity: String,
    /// The name in the column `material`; empty if there is none.
    pub(super) material: String,
}

/// The cells of a row, without angles.
#[derive(Deserialize)]
struct Cells {
    /// Some programs write whole numbers as 3.0.
    index: Option<f64>,
    r: Option<f32>,
    g: Option<f32>,
    b: Option<f32>,
    value: Option<f32>,
    saturated: Option<u8>,
    noise: Option<f32>,
    #[serde(default)]
    quantity: String,
    #[serde(default)]
    material: String,
}

/// Reads all rows of a table.
pub(super) fn read_rows(table: &Table, args: &AngleArgs) -> Result<Vec<ReadingRow>, TableError> {
    let angles = AngleColumns::find(table)?;
    if angles.is_none() && !table.has(&[INDEX]) {
        return Err(table.file_error(format!(
            "line 1 names the columns {}, which do not identify the sample of a reading; add theta_h, theta_d, \
             phi_d, or theta_i, phi_i, theta_o, phi_o (degrees), or index (the sample's number, from 0)",
            table.names()
        )));
    }
    let channels = match (table.has(&CHANNELS), table.has(&[MONOCHROME])) {
        (true, false) => CHANNELS,
        (false, true) => [MONOCHROME; 3],
        (has_both, _) => {
            let defect = match has_both {
                true => "which hold two sets of readings; keep",
                false => "none of which holds readings; add",
            };
            return Err(table.file_error(format!(
                "line 1 names the columns {}, {defect} r, g, b, or value for a sensor with one channel",
                table.names()
            )));
        }
    };
    let angles = match angles {
        Some(columns) => columns.parse_all(table, args)?,
        None => vec![None; table.rows().len()],
    };
    let rows = table.rows().iter().zip(angles).map(|(row, angles)| {
        let cells = table.parse::<Cells>(row)?;
        cells
            .check(table, row, channels, angles)
            .map_err(|message| table.line_error(row.line, &message))
    });
    rows.collect()
}

impl Cells {
    /// Returns the row of these cells. The error describes the invalid cell.
    fn check(
        self,
        table: &Table,
        row: &Row,
        channels: [&str; 3],
        angles: Option<RowAngles>,
    ) -> Result<ReadingRow, String> {
        let index = match self.index {
            Some(index) if index < 0.0 || index.fract() != 0.0 => {
                return Err(format!(
                    "column index: {index} is not a sample's number; give 0, 1, 2, ..."
                ));
            }
            index => index.map(|index| index as usize),
        };
        if index.is_none() && angles.is_none() {
            return Err("the directions and the index are empty; give one of them".to_owned());
        }
        let values = match self.value {
            Some(value) => [Some(value); 3],
            None => [self.r, self.g, self.b],
        };
        // Programs write a missing value as an empty cell or as NaN.
        let values = values.map(|value| value.filter(|value| !value.is_nan()));
        for (name, value) in channels.iter().zip(values) {
            match value {
                Some(value) if value.is_infinite() => {
                    return Err(format!(
                        "column {name}: {} is not finite; leave it empty if nothing was read",
                        escaped(table.cell(row, name))
                    ));
                }
                None if values.iter().any(Option::is_some) => {
                    return Err(format!(
                        "column {name}: it is empty but the other channels are not; give all three, or none if \
                         nothing was read"
                    ));
                }
                _ => {}
            }
        }
        let saturated = match self.saturated {
            None | Some(0) => false,
            Some(1) => true,
            Some(other) => {
                return Err(format!(
                    "column saturated: {other} is neither 0 nor 1; give 1 if the sensor was saturated"
                ));
            }
        };
        if let Some(noise) = self.noise.filter(|noise| !(0.0..=10.0).contains(noise)) {
            return Err(format!(
                "column noise: {noise} is out of range; give the standard deviation relative to the reading, 0 to 10"
            ));
        }
        Ok(ReadingRow {
            line: row.line,
            noise: self.noise,
            index,
            angles,
            values: match values {
                [Some(r), Some(g), Some(b)] => Some([r, g, b]),
                _ => None,
            },
            saturated,
            quantity: self.quantity.to_lowercase(),
            material: self.material,
        })
    }
}
