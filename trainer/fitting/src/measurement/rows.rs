//! Rows of readings, from a file or an array.

use std::path::{Path, PathBuf};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Angles;
use glimpse_materials::untrusted::escaped;
use glimpse_materials::{Viewing, weighted_sums};
use serde::{Deserialize, Serialize};

use super::angles::{AngleArgs, AngleColumns};
use super::layout::{CHANNELS, INDEX, MONOCHROME};
use super::table::{Row, Table, TableError};

/// The largest number of bands.
const MAX_BANDS: usize = 128;

/// One reading of a lab.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct LabReading {
    /// The line of the file, or the index in an array, from 0.
    pub line: usize,
    /// The index of the recipe's sample, from 0, if it is stated.
    pub index: Option<usize>,
    /// Rusinkiewicz angles in radians, if the directions are stated.
    pub angles: Option<Angles<f64>>,
    /// The numbers of red, green and blue, or of the bands.
    pub numbers: Vec<f32>,
    /// True if the sensor was saturated.
    pub saturated: bool,
    /// The standard deviation of the noise, relative to the reading; None if it is not stated.
    pub noise: Option<f32>,
}

/// Readings of a file or of an array.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReadingRows {
    /// The file, or the name of the array.
    pub path: PathBuf,
    /// The wavelengths of bands in nm, in ascending order; empty for readings in RGB.
    pub wavelengths: Vec<f32>,
    /// The readings, without empty rows.
    pub readings: Vec<LabReading>,
    /// The standard deviation of the noise of rows that do not state it, relative to the reading; None if it is unknown.
    pub noise: Option<f32>,
    /// True if the readings are from an array.
    is_array: bool,
    /// True if one column has the numbers of red, green and blue.
    pub(super) is_monochrome: bool,
    /// The weights of bands in red, green and blue.
    weights: Vec<[f64; 3]>,
    /// The line and the lowercase text of each entry in the column `quantity` that differs from those above.
    pub(super) quantities: Vec<(usize, String)>,
}

impl ReadingRows {
    /// Reads a file.
    ///
    /// # Errors
    /// If the file cannot be read, or a cell is not valid.
    pub fn read(path: &Path, args: &AngleArgs) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let angles = AngleColumns::find(&table)?;
        if angles.is_none() && !table.has(&[INDEX]) {
            return Err(table.columns_error(
                "which do not identify the sample of a reading; add theta_h, theta_d, phi_d, or theta_i, phi_i, \
                 theta_o, phi_o (degrees), or index (the sample's number, from 0)",
            ));
        }
        let bands = table.bands();
        let wavelengths: Vec<f32> = bands.iter().map(|(_, wavelength)| *wavelength).collect();
        let mut all = Self::new(path.into(), false, wavelengths);
        all.is_monochrome = table.has(&[MONOCHROME]);
        let sets = [table.has(&CHANNELS), all.is_monochrome, !bands.is_empty()];
        let count = sets.into_iter().filter(|set| *set).count();
        if count != 1 {
            let defect = if count == 0 {
                "none of which holds readings; add"
            } else {
                "which hold two sets of readings; keep"
            };
            return Err(table.columns_error(&format!(
                "{defect} r, g, b, or value for a sensor with one channel, or wavelengths in nm such as 390nm"
            )));
        }
        if !all.wavelengths.is_sorted_by(|one, other| one < other) || bands.len() > MAX_BANDS {
            return Err(table.file_error(format!(
                "line {} names {} bands; give at most {MAX_BANDS}, each wavelength once",
                table.layout.line,
                bands.len()
            )));
        }
        let columns: Vec<&str> = if bands.is_empty() {
            all.channels().to_vec()
        } else {
            bands.iter().map(|(name, _)| &name[..]).collect()
        };
        table.check_value_units()?;
        let angles = match angles {
            Some(columns) => columns.parse_all(&table, args)?,
            None => vec![None; table.rows.len()],
        };
        let Some(first) = table.rows.first() else {
            return Err(table.file_error(format!(
                "it has no rows below line {}; add the readings",
                table.layout.line
            )));
        };
        // Such as `trainer query` writes.
        let material = table.cell(first, "material");
        for (row, angles) in table.rows.iter().zip(angles) {
            let other = table.cell(row, "material");
            if other != material {
                let message = format!(
                    "column material: it is {}, but the rows above are of {}; give one file per material",
                    escaped(other),
                    escaped(material)
                );
                return Err(table.line_error(row.line, &message));
            }
            let mut quantity = table.cell(row, "quantity").to_lowercase();
            // ASTM's name, which the options accept as well.
            if quantity == "brdf-cos" {
                quantity = "brdf-cos-o".to_owned();
            }
            let is_known = |(_, known): &(usize, String)| *known == quantity;
            if !quantity.is_empty() && !all.quantities.iter().any(is_known) {
                all.quantities.push((row.line, quantity));
            }
            all.readings.push(read_row(&table, row, &columns, angles)?);
        }
        Ok(all.without_empty_rows())
    }

    /// Takes readings from an array of this name. Those without numbers are missing. `wavelengths` are those of bands in
    /// nm, in ascending order; none for RGB.
    #[must_use]
    pub fn from_array(name: &str, wavelengths: Vec<f32>, readings: Vec<LabReading>) -> Self {
        let all = Self {
            readings,
            ..Self::new(name.into(), true, wavelengths)
        };
        all.without_empty_rows()
    }

    fn new(path: PathBuf, is_array: bool, wavelengths: Vec<f32>) -> Self {
        Self {
            path,
            is_array,
            is_monochrome: false,
            noise: None,
            weights: Viewing::default().rgb_weights(&wavelengths),
            wavelengths,
            quantities: Vec::new(),
            readings: Vec::new(),
        }
    }

    fn without_empty_rows(mut self) -> Self {
        self.readings.retain(|reading| !reading.numbers.is_empty());
        self
    }

    /// Returns the columns of red, green and blue.
    fn channels(&self) -> [&'static str; 3] {
        if self.is_monochrome {
            [MONOCHROME; 3]
        } else {
            CHANNELS
        }
    }

    /// Returns the numbers of a reading in red, green and blue.
    pub(super) fn rgb(&self, reading: &LabReading) -> [f32; 3] {
        if let [red, green, blue] = reading.numbers[..]
            && self.weights.is_empty()
        {
            return [red, green, blue];
        }
        let numbers = reading.numbers.iter().map(|number| f64::from(*number));
        weighted_sums(numbers, &self.weights).map(|sum| sum as f32)
    }

    /// Checks that no row states a quantity other than `name`.
    ///
    /// # Errors
    /// The first row with another quantity.
    pub fn check_quantity(&self, name: &str) -> Result<(), TableError> {
        let mut quantities = self.quantities.iter();
        let Some((line, stated)) = quantities.find(|(_, stated)| stated != name) else {
            return Ok(());
        };
        let message = format!(
            "column quantity: it is `{}`, but the options or an earlier row state `{name}`; give the options of that \
             quantity, or correct the column",
            escaped(stated)
        );
        Err(self.line_error(*line, &message))
    }

    /// Returns an error that concerns one row.
    pub(super) fn line_error(&self, line: usize, message: &str) -> TableError {
        self.file_error(self.at_line(line, message))
    }

    /// Returns a message that concerns one row.
    pub(super) fn at_line(&self, line: usize, message: &str) -> String {
        let label = if self.is_array { "row" } else { "line" };
        format!("{label} {line}, {message}")
    }

    /// Returns an error that concerns a reading.
    pub(super) fn reading_error(&self, reading: &LabReading, error: Error) -> TableError {
        let [first, second] = error.details.map(|detail| detail as usize);
        let channel = match error.code {
            ErrorCode::ReadingNonFinite | ErrorCode::ReadingNegative => second,
            ErrorCode::ChannelNonFinite
            | ErrorCode::WhiteNotBrighter
            | ErrorCode::WhiteReflectance
            | ErrorCode::WhiteSaturated => first,
            _ => {
                let message = format!("{error}; correct the row or remove it");
                return self.line_error(reading.line, &message);
            }
        };
        let (name, number) = (self.channels()[channel], self.rgb(reading)[channel]);
        let text = error.code.text();
        let message = format!(
            "column {name}: {number} is invalid, because {text}; correct the row or remove it"
        );
        self.line_error(reading.line, &message)
    }

    /// Returns an error that concerns all rows.
    pub(super) fn file_error(&self, message: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            message,
        }
    }
}

/// Reads the cells of a row. `columns` are those of the numbers, which are empty if nothing was read.
fn read_row(
    table: &Table,
    row: &Row,
    columns: &[&str],
    angles: Option<Angles<f64>>,
) -> Result<LabReading, TableError> {
    let error = |message: String| Err(table.line_error(row.line, &message));
    // Some programs write whole numbers as 3.0.
    let index = table.number::<f64>(row, INDEX, "give the sample's number, 0, 1, 2, ...")?;
    if let Some(index) = index.filter(|index| !(*index >= 0.0 && index.fract() == 0.0)) {
        return error(format!(
            "column index: {index} is not a sample's number; give 0, 1, 2, ..."
        ));
    }
    if index.is_none() && angles.is_none() {
        return error("the directions and the index are empty; give one of them".to_owned());
    }
    let mut numbers = Vec::with_capacity(columns.len());
    let mut empty = None;
    for name in columns {
        let remedy = "leave it empty if nothing was read";
        // Programs write a missing value as an empty cell or as NaN.
        match table.number::<f32>(row, name, remedy)? {
            Some(number) if number.is_infinite() => {
                let cell = escaped(table.cell(row, name));
                return error(format!("column {name}: {cell} is not finite; {remedy}"));
            }
            Some(number) if !number.is_nan() => numbers.push(number),
            _ => empty = empty.or(Some(name)),
        }
    }
    if let Some(name) = empty.filter(|_| !numbers.is_empty()) {
        return error(format!(
            "column {name}: it is empty but the other channels are not; give all {}, or none if nothing was read",
            columns.len()
        ));
    }
    let saturated = match &table.cell(row, "saturated").to_lowercase()[..] {
        "" | "0" | "0.0" | "false" => false,
        "1" | "1.0" | "true" => true,
        other => {
            return error(format!(
                "column saturated: `{}` is neither 0 nor 1; give 1 if the sensor was saturated",
                escaped(other)
            ));
        }
    };
    let remedy = "give the standard deviation relative to the reading, 0 to 10";
    let noise = table.number::<f32>(row, "noise", remedy)?;
    if let Some(noise) = noise.filter(|noise| !(0.0..=10.0).contains(noise)) {
        return error(format!("column noise: {noise} is out of range; {remedy}"));
    }
    Ok(LabReading {
        line: row.line,
        index: index.map(|index| index as usize),
        angles,
        numbers,
        saturated,
        noise,
    })
}
