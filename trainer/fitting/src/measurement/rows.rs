//! Rows of readings from a file or an array.

use std::path::{Path, PathBuf};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{Angles, Directions};
use glimpse_materials::Viewing;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::untrusted::escaped;

use super::angles::{above_horizon, rusinkiewicz, to_directions};
use super::convention::AngleArgs;
use super::layout::CHANNELS;
use super::reading_row::{LabReading, ReadingRow, read_rows, to_rgb};
use super::table::{Table, TableError};

/// The error message for a saturated white reading.
pub(super) const SATURATED_WHITE: &str =
    "column saturated: the white reading is saturated; read the white with less light";

/// Readings of a file or of an array.
pub struct Rows {
    /// The file, or the name of the array, for error messages.
    pub(super) path: PathBuf,
    /// The name of a row in error messages: "line" or "row".
    pub(super) row_label: &'static str,
    /// The columns of red, green and blue.
    channels: [&'static str; 3],
    /// The wavelengths of bands in nm; empty if there are none.
    wavelengths: Vec<f32>,
    pub(super) rows: Vec<ReadingRow>,
}

impl Rows {
    /// Reads a file.
    ///
    /// # Errors
    /// If the file cannot be read, or a cell is not valid.
    pub fn read(path: &Path, args: &AngleArgs) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let (rows, channels, wavelengths) = read_rows(&table, args)?;
        let Some(first) = rows.first() else {
            return Err(table.file_error(format!(
                "it has no rows below line {}; add the readings",
                table.header_line
            )));
        };
        // Such as `trainer query` writes.
        if let Some(other) = rows.iter().find(|row| row.material != first.material) {
            return Err(table.line_error(
                other.line,
                &format!(
                    "column material: it is {}, but the rows above are of {}; give one file per material",
                    escaped(&other.material),
                    escaped(&first.material)
                ),
            ));
        }
        Ok(Self {
            path: table.path().to_owned(),
            row_label: "line",
            channels,
            wavelengths,
            rows,
        })
    }

    /// Converts an array. `wavelengths` are those of bands in nm, in ascending order; none for RGB.
    #[must_use]
    pub fn from_readings(readings: &[LabReading], wavelengths: &[f32]) -> Self {
        let weights = Viewing::default().rgb_weights(wavelengths);
        let rows = (0..).zip(readings).map(|(line, reading)| ReadingRow {
            line,
            index: reading.sample,
            angles: reading
                .directions
                .map(|[incoming, outgoing]| rusinkiewicz(incoming, outgoing)),
            values: reading
                .values
                .as_ref()
                .and_then(|values| to_rgb(values, &weights)),
            bands: match weights.is_empty() {
                true => Vec::new(),
                false => reading.values.clone().unwrap_or_default(),
            },
            saturated: reading.saturated,
            noise: reading.noise,
            ..ReadingRow::default()
        });
        Self {
            path: "readings".into(),
            row_label: "row",
            channels: CHANNELS,
            wavelengths: wavelengths.to_vec(),
            rows: rows.collect(),
        }
    }

    /// Returns the wavelengths of bands in nm, in ascending order; none for readings in RGB.
    #[must_use]
    pub fn wavelengths(&self) -> &[f32] {
        &self.wavelengths
    }

    /// Returns the column `quantity` of the first row that has an entry there.
    pub(super) fn stated_quantity(&self) -> Option<&str> {
        let mut stated = self.rows.iter().map(|row| &row.quantity[..]);
        stated.find(|quantity| !quantity.is_empty())
    }

    /// Checks that no row states a quantity other than `name`.
    ///
    /// # Errors
    /// The first row with another quantity.
    pub(super) fn check_quantity(&self, name: &str) -> Result<(), TableError> {
        // `brdf-cos` is an alias of ASTM's quantity, which the options accept as well.
        let is_other = |row: &&ReadingRow| match &row.quantity[..] {
            "" => false,
            "brdf-cos" => name != "brdf-cos-o",
            stated => stated != name,
        };
        match self.rows.iter().find(is_other) {
            None => Ok(()),
            Some(row) => Err(self.line_error(
                row.line,
                &format!(
                    "column quantity: it is `{}`, but the options or an earlier row state `{name}`; give the options \
                     of that quantity, or correct the column",
                    escaped(&row.quantity)
                ),
            )),
        }
    }

    /// Returns an error that concerns one row.
    pub(super) fn line_error(&self, line: u64, message: &str) -> TableError {
        self.file_error(format!("{} {line}, {message}", self.row_label))
    }

    /// Returns an error that concerns a reading. `numbers` are those of red, green and blue in the row.
    pub(super) fn reading_error(&self, line: u64, error: Error, numbers: [f32; 3]) -> TableError {
        let [first, second] = error.details.map(|detail| detail as usize);
        let channel = match error.code {
            ErrorCode::ReadingNonFinite | ErrorCode::ReadingNegative => second,
            ErrorCode::ChannelNonFinite
            | ErrorCode::WhiteNotBrighter
            | ErrorCode::WhiteReflectance
            | ErrorCode::WhiteSaturated => first,
            _ => return self.line_error(line, &format!("{error}; correct the row or remove it")),
        };
        let (name, number) = (self.channels[channel], numbers[channel]);
        let text = error.code.text();
        self.line_error(
            line,
            &format!(
                "column {name}: {number} is invalid, because {text}; correct the row or remove it"
            ),
        )
    }

    /// Returns an error that concerns all rows.
    pub(super) fn file_error(&self, message: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            message,
        }
    }

    /// Forgets the indices of samples, of rows that have directions: they are those of another pattern. Removes rows
    /// without a reading, unless all are.
    pub(super) fn forget_indices(&mut self) {
        if self.rows.iter().any(|row| row.values.is_some()) {
            self.rows.retain(|row| row.values.is_some());
        }
        for row in self.rows.iter_mut().filter(|row| row.angles.is_some()) {
            row.index = None;
        }
    }

    /// Refuses rows that state their noise, which only a recipe without a pattern takes into account.
    pub(super) fn refuse_noise(&self) -> Result<(), TableError> {
        match self.rows.iter().find(|row| row.noise.is_some()) {
            None => Ok(()),
            Some(row) => Err(self.line_error(
                row.line,
                "column noise: it has no effect with a recipe for its own directions; remove it, or fit with a recipe of \
                 `--samples any`",
            )),
        }
    }

    /// Returns the different directions of the rows, in their order, and the standard deviation of each mean reading.
    ///
    /// # Errors
    /// The first row without directions, or with one that is not above the horizon.
    pub(super) fn directions(&self) -> Result<Vec<(Angles<f32>, f32)>, TableError> {
        // The sum of variances, and the number of readings.
        let mut sums: Vec<(Angles<f32>, f32, f32)> = Vec::new();
        for row in self.rows.iter().filter(|row| row.values.is_some()) {
            let error = |message| self.line_error(row.line, message);
            let angles = row.angles.ok_or_else(|| {
                error("it has an index, but this recipe has no pattern; give the directions")
            })?;
            let angles = above_horizon(angles).ok_or_else(|| {
                error("a direction is not above the horizon; correct the row or remove it")
            })?;
            let variance = row.noise.unwrap_or_default().powi(2);
            match sums.iter_mut().find(|(known, ..)| *known == angles) {
                Some((_, sum, count)) => (*sum, *count) = (*sum + variance, *count + 1.0),
                None => sums.push((angles, variance, 1.0)),
            }
        }
        let each = sums.into_iter();
        Ok(each
            .map(|(angles, sum, count)| (angles, sum.sqrt() / count))
            .collect())
    }

    /// Returns the directions and the numbers of the only row. If the row has only an index, the directions are those
    /// of the sample.
    ///
    /// # Errors
    /// If there is more than one row, or its directions or numbers are missing.
    pub(super) fn single_reading(
        &self,
        pattern: &[Angles<f32>],
    ) -> Result<(Directions<f32>, [f32; 3]), TableError> {
        let [row] = &self.rows[..] else {
            return Err(self.file_error(format!(
                "it has {} rows, but with --footprint the white is read once; give one row",
                self.rows.len()
            )));
        };
        let sample_angles = row
            .index
            .and_then(|index| pattern.get(index))
            .map(angles_to_f64);
        let angles = row.angles.or(sample_angles);
        let (Some(angles), Some(values)) = (angles, row.values) else {
            return Err(self.line_error(
                row.line,
                "the directions or the reading are missing; give both",
            ));
        };
        if row.saturated {
            return Err(self.line_error(row.line, SATURATED_WHITE));
        }
        Ok((to_directions(angles), values))
    }
}
