//! Rows of readings, from a file or an array.

use std::path::PathBuf;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Angles;
use glimpse_materials::untrusted::escaped;
use glimpse_materials::{Lab, Viewing, weighted_sums};
use serde::{Deserialize, Serialize};

use super::angles::{above_horizon, polar};
use super::columns::{CHANNELS, CIELAB, MONOCHROME};
use super::conventions::{AngleArgs, AngleFormat, AngleSet, AngleUnit, StatedAngles};
use super::optics::Optics;
use super::summary::TableSummary;
use super::table::TableError;

/// One reading of a lab.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct LabReading {
    /// The line of the file, or the index in an array, from 0.
    pub line: usize,
    /// The index of the recipe's sample, from 0, if it is stated.
    pub index: Option<usize>,
    /// Rusinkiewicz angles in radians, if the directions are stated.
    pub angles: Option<Angles<f64>>,
    /// The numbers of the angle columns, in the order of the help of `trainer query`, before their conversion by units and
    /// conventions; 0 for further columns.
    pub stated_angles: Option<StatedAngles>,
    /// The numbers of red, green and blue, or of the bands.
    pub numbers: Vec<f32>,
    /// True if they are one number of a sensor without colors.
    pub is_gray: bool,
    /// The instrument.
    pub optics: Optics,
    /// True if the sensor was saturated.
    pub saturated: bool,
    /// The standard deviation of the noise, relative to the reading; None if it is not stated.
    pub noise: Option<f32>,
    /// The exposure in s; None if it is not stated.
    pub exposure: Option<f32>,
    /// The place of the reading, such as a pixel of a photograph.
    pub place: Option<String>,
}

/// Readings of a file or of an array.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ReadingRows {
    /// The file, or the name of the array.
    pub path: PathBuf,
    /// The name of the material: that of the file without its extension, or the text in the column that splits the file.
    pub name: String,
    /// The meaning that the file was given.
    pub summary: TableSummary,
    /// The wavelengths of bands in nm, in ascending order; empty for readings in RGB.
    pub wavelengths: Vec<f32>,
    /// The conditions of colors in CIELAB, which then are the numbers of rows that are not gray.
    pub cielab: Option<Viewing>,
    /// The readings, without empty rows.
    pub readings: Vec<LabReading>,
    /// The standard deviation of the noise of rows that do not state it, relative to the reading; None if it is unknown.
    pub noise: Option<f32>,
    /// The units and conventions by which angles were converted.
    pub angle_args: AngleArgs,
    /// The meaning of stated angles; None if there are none.
    pub(super) angle_format: Option<AngleFormat>,
    /// True if the readings are from an array.
    is_array: bool,
    /// True if all rows are gray.
    pub(super) is_monochrome: bool,
    /// The weights of bands in red, green and blue.
    weights: Vec<[f64; 3]>,
    /// The line, the column and the lowercase text of each statement of a quantity that differs from those above.
    pub(super) quantities: Vec<(usize, String, String)>,
}

impl ReadingRows {
    /// Takes readings from an array of this name. Those without numbers are missing. `wavelengths` are those of bands in
    /// nm, in ascending order; none for RGB.
    #[must_use]
    pub fn from_array(name: &str, wavelengths: Vec<f32>, mut readings: Vec<LabReading>) -> Self {
        for reading in &mut readings {
            reading.stated_angles = reading.angles.map(polar);
        }
        let format = AngleFormat {
            set: AngleSet::Directions,
            stated: [Some(AngleUnit::Radians); 4],
        };
        let all = Self {
            angle_format: Some(format),
            readings,
            ..Self::new(name.into(), true, wavelengths)
        };
        all.without_empty_rows()
    }

    /// Returns the Rusinkiewicz angles in radians of each reading by other units and conventions; None for a reading without
    /// directions. Stated units hold nevertheless. None if an angle is then out of range, or a direction is not above the
    /// horizon.
    #[must_use]
    pub fn reread(&self, args: &AngleArgs) -> Option<Vec<Option<Angles<f64>>>> {
        let angles = self.readings.iter().map(|reading| {
            let (Some(format), Some(stated)) = (&self.angle_format, &reading.stated_angles) else {
                return Some(None);
            };
            let angles = format.convert(stated, args).ok()?;
            above_horizon(angles).map(|_| Some(angles))
        });
        angles.collect()
    }

    pub(super) fn new(path: PathBuf, is_array: bool, wavelengths: Vec<f32>) -> Self {
        let name = path.file_stem().unwrap_or_default();
        Self {
            name: name.to_string_lossy().into_owned(),
            path,
            is_array,
            weights: Viewing::default().rgb_weights(&wavelengths),
            wavelengths,
            ..Self::default()
        }
    }

    pub(super) fn without_empty_rows(mut self) -> Self {
        self.readings.retain(|reading| !reading.numbers.is_empty());
        self
    }

    /// Returns the columns of red, green and blue.
    pub(super) fn channels(&self) -> [&'static str; 3] {
        match self.cielab {
            _ if self.is_monochrome => [MONOCHROME; 3],
            Some(_) => CIELAB,
            None => CHANNELS,
        }
    }

    /// Returns the numbers of a reading in red, green and blue.
    pub(super) fn rgb(&self, reading: &LabReading) -> [f32; 3] {
        if let [red, green, blue] = reading.numbers[..]
            && self.weights.is_empty()
        {
            let Some(viewing) = self.cielab.filter(|_| !reading.is_gray) else {
                return [red, green, blue];
            };
            let [l, a, b] = [red, green, blue].map(f64::from);
            return viewing
                .rgb_of_lab(Lab { l, a, b })
                .map(|value| value as f32);
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
        let Some((line, column, stated)) = quantities.find(|(_, _, stated)| stated != name) else {
            return Ok(());
        };
        let message = format!(
            "column {column}: its quantity is `{}`, but the options or an earlier row state `{name}`; give the options of that \
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
