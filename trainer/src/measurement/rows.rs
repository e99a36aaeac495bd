//! Rows of readings from a file or an array, and their samples in a pattern.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_materials::Viewing;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::untrusted::escaped;

use super::angles::{RowAngles, above_horizon};
use super::convention::AngleArgs;
use super::layout::CHANNELS;
use super::matching::{AngularDistance, IsotropicAngles};
use super::reading_row::{LabReading, ReadingRow, read_rows, to_rgb};
use super::table::{Table, TableError};

/// The largest distance of a row from its sample, in degrees: a typical error of a lab's arms.
const TOLERANCE_DEGREES: f64 = 0.5;
const TOLERANCE: f64 = TOLERANCE_DEGREES.to_radians();

/// The error message for a saturated white reading.
pub(super) const SATURATED_WHITE: &str =
    "column saturated: the white reading is saturated; read the white with less light";

/// Readings of a file or of an array.
pub struct Rows {
    /// The file, or the name of the array, for error messages.
    path: PathBuf,
    /// The name of a row in error messages: "line" or "row".
    row_label: &'static str,
    /// The columns of red, green and blue.
    channels: [&'static str; 3],
    /// The wavelengths of bands in nm; empty if there are none.
    wavelengths: Vec<f32>,
    rows: Vec<ReadingRow>,
}

/// A row and its sample in the pattern.
pub(super) struct MatchedRow<'r> {
    /// The numbers of the bands; empty if there are none, or nothing was read.
    pub(super) bands: &'r [f32],
    pub(super) line: u64,
    pub(super) sample: usize,
    /// The row's own directions, or else those of the sample.
    pub(super) directions: Directions<f32>,
    /// None if nothing was read.
    pub(super) values: Option<[f32; 3]>,
    pub(super) saturated: bool,
    /// The distance of the row's directions from the sample's; None if the row has only an index.
    pub(super) distance: Option<AngularDistance>,
}

/// A likely cause of rows that match no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    /// Polar angles are measured from the surface.
    Elevation,
    /// The azimuth of the sensor is 0 in the mirror direction.
    FromMirror,
    /// Light and sensor are exchanged.
    Exchanged,
    /// Azimuths have the opposite sense.
    Mirrored,
}

impl Cause {
    const ALL: [Self; 4] = [
        Self::Elevation,
        Self::FromMirror,
        Self::Exchanged,
        Self::Mirrored,
    ];
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
            angles: reading.directions.map(RowAngles::from_vectors),
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
            let angles = above_horizon(angles.to_rusinkiewicz()).ok_or_else(|| {
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

    /// Matches each row to the nearest sample, within [`TOLERANCE`].
    ///
    /// # Errors
    /// The first row that matches no sample, with its distance and the likely cause.
    pub(super) fn match_to_pattern(
        &self,
        pattern: &[Angles<f32>],
    ) -> Result<Vec<MatchedRow<'_>>, TableError> {
        let pattern: Vec<Angles<f64>> = pattern.iter().map(angles_to_f64).collect();
        let samples: Vec<IsotropicAngles> = pattern
            .iter()
            .copied()
            .map(IsotropicAngles::from_angles)
            .collect();
        let matched = self.rows.iter().map(|row| {
            let (sample, distance) = self.find_sample(row, &samples)?;
            let angles = row
                .angles
                .map_or(pattern[sample], RowAngles::to_rusinkiewicz);
            Ok(MatchedRow {
                bands: &row.bands,
                line: row.line,
                sample,
                directions: to_directions(angles),
                values: row.values,
                saturated: row.saturated,
                distance,
            })
        });
        matched.collect()
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
        let angles = row.angles.map(RowAngles::to_rusinkiewicz).or(sample_angles);
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

    /// Finds the sample of a row. Returns it with its distance, if the row has directions.
    fn find_sample(
        &self,
        row: &ReadingRow,
        samples: &[IsotropicAngles],
    ) -> Result<(usize, Option<AngularDistance>), TableError> {
        let count = samples.len();
        if let Some(index) = row.index.filter(|index| *index >= count) {
            return Err(self.line_error(
                row.line,
                &format!(
                    "column index: {index} is out of range; the recipe has {count} samples, give 0 to {}",
                    count - 1
                ),
            ));
        }
        let Some(angles) = row.angles else {
            return match row.index {
                Some(index) => Ok((index, None)),
                None => Err(self.line_error(
                    row.line,
                    "the directions and the index are missing; give one of them",
                )),
            };
        };
        let angles = isotropic(angles);
        let Some((sample, distance)) = nearest(row, angles, samples) else {
            return Err(
                self.file_error("the recipe has no samples; give another recipe".to_owned())
            );
        };
        if distance.radians <= TOLERANCE {
            return Ok((sample, Some(distance)));
        }
        let IsotropicAngles {
            theta_i,
            theta_o,
            phi,
        } = samples[sample];
        let [theta_i, theta_o, phi] =
            [theta_i, theta_o, phi.rem_euclid(TAU)].map(|angle| round(angle.to_degrees()));
        let target = match (row.index, angles.nearest(samples)) {
            (Some(_), Some((nearest, _))) if nearest != sample => {
                format!("sample {sample}, the row's index (sample {nearest} is nearer)")
            }
            (Some(_), _) => format!("sample {sample}, the row's index"),
            (None, _) => format!("sample {sample}, the nearest"),
        };
        let mut message = format!(
            "its directions are not those of {target} (theta_i {theta_i}, theta_o {theta_o}, phi_o - phi_i {phi} \
             degrees): they are {distance}, and at most {TOLERANCE_DEGREES} degrees are accepted"
        );
        let cause = self.cause(samples);
        if cause.is_none() && row.index.is_none() {
            return Err(TableError::OffPattern {
                path: self.path.clone(),
                message: format!("{} {}, {message}", self.row_label, row.line),
            });
        }
        message += &match cause {
            Some(Cause::Elevation) => format!(
                ". All {} rows match if the polar angles are measured from the surface; give --convention elevation",
                self.rows.len()
            ),
            Some(Cause::FromMirror) => format!(
                ". All {} rows match if the azimuth of the sensor is 0 in the mirror direction; give --convention \
                 from-mirror",
                self.rows.len()
            ),
            Some(Cause::Exchanged) => format!(
                ". All {} rows match if light and sensor are exchanged; exchange their columns",
                self.rows.len()
            ),
            Some(Cause::Mirrored) => format!(
                ". All {} rows match if the azimuths have the opposite sense; negate phi_i and phi_o (or phi_d, or y \
                 of vectors)",
                self.rows.len()
            ),
            None => "; correct the row (`trainer inspect` prints the recipe's directions), or remove the column index"
                .to_owned(),
        };
        Err(self.line_error(row.line, &message))
    }

    /// Returns the first cause that explains all rows.
    fn cause(&self, samples: &[IsotropicAngles]) -> Option<Cause> {
        let is_cause = |cause: &Cause| {
            self.rows.iter().all(|row| {
                let matches = |angles| {
                    nearest(row, angles, samples)
                        .is_some_and(|(_, distance)| distance.radians <= TOLERANCE)
                };
                row.angles.is_none_or(|angles| match cause {
                    Cause::Elevation => matches(isotropic(angles).from_surface()),
                    Cause::FromMirror => matches(isotropic(angles).opposite()),
                    Cause::Exchanged => matches(isotropic(angles).exchanged()),
                    Cause::Mirrored => matches(isotropic(angles).mirrored()),
                })
            })
        };
        Cause::ALL.into_iter().find(is_cause)
    }
}

/// Returns the sample of a row with these angles and its distance: the sample of the row's index, or else the nearest one.
/// None if the index is out of range.
fn nearest(
    row: &ReadingRow,
    angles: IsotropicAngles,
    samples: &[IsotropicAngles],
) -> Option<(usize, AngularDistance)> {
    match row.index {
        Some(index) => Some((index, angles.distance(samples.get(index)?))),
        None => angles.nearest(samples),
    }
}

fn isotropic(angles: RowAngles) -> IsotropicAngles {
    IsotropicAngles::from_angles(angles.to_rusinkiewicz())
}

/// Rounds to two decimals.
fn round(degrees: f64) -> f64 {
    (degrees * 100.0).round() / 100.0
}

fn to_directions(angles: Angles<f64>) -> Directions<f32> {
    let pair = HalfDifference::from_angles(angles).directions();
    Directions {
        incoming: pair.incoming.map(|x| x as f32),
        outgoing: pair.outgoing.map(|x| x as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// theta_i, phi_i, theta_o, phi_o in degrees.
    const PATTERN: [[f64; 4]; 3] = [
        [20.0, 0.0, 50.0, 70.0],
        [40.0, 0.0, 40.0, 110.0],
        [30.0, 0.0, 60.0, 180.0],
    ];

    /// Returns the likely cause of rows that match no sample: None if all rows match, and Some(None) if the cause is
    /// unknown.
    fn cause(rows: &[[f64; 4]], indexed: bool) -> Option<Option<Cause>> {
        let radians = |row: &[f64; 4]| RowAngles::Directions(row.map(f64::to_radians));
        let samples = PATTERN.map(|row| isotropic(radians(&row)));
        let rows = rows.iter().enumerate().map(|(index, row)| ReadingRow {
            index: indexed.then_some(index),
            angles: Some(radians(row)),
            ..ReadingRow::default()
        });
        let rows = Rows {
            path: "rows".into(),
            row_label: "row",
            channels: CHANNELS,
            wavelengths: Vec::new(),
            rows: rows.collect(),
        };
        let mut each = rows.rows.iter();
        let any = each.any(|row| rows.find_sample(row, &samples).is_err());
        any.then(|| rows.cause(&samples))
    }

    #[test]
    fn finds_cause_of_unmatched_rows() {
        let mirror =
            |[theta_i, phi_i, theta_o, phi_o]: [f64; 4]| [theta_i, -phi_i, theta_o, -phi_o];
        let mirrored = PATTERN.map(mirror);
        let exchanged =
            PATTERN.map(|[theta_i, phi_i, theta_o, phi_o]| [theta_o, phi_o, theta_i, phi_i]);
        let unrelated = [mirrored[0], [1.0, 0.0, 2.0, 0.0]];
        let elevations = PATTERN
            .map(|[theta_i, phi_i, theta_o, phi_o]| [90.0 - theta_i, phi_i, 90.0 - theta_o, phi_o]);
        let from_mirror = PATTERN
            .map(|[theta_i, phi_i, theta_o, phi_o]| [theta_i, phi_i, theta_o, phi_o - 180.0]);
        for (rows, indexed, expected) in [
            (&PATTERN[..], false, None),
            (&PATTERN, true, None),
            (&mirrored, false, Some(Some(Cause::Mirrored))),
            (&mirrored, true, Some(Some(Cause::Mirrored))),
            // In the plane of incidence, mirrored rows match.
            (&mirrored[2..], false, None),
            (&unrelated, false, Some(None)),
            (&unrelated, true, Some(None)),
            (&exchanged, false, Some(Some(Cause::Exchanged))),
            (&exchanged, true, Some(Some(Cause::Exchanged))),
            // If theta_i equals theta_o, mirroring and exchanging give the same angles.
            (&mirrored[1..2], false, Some(Some(Cause::Exchanged))),
            (&mirrored[..2], false, Some(Some(Cause::Mirrored))),
            (&elevations, false, Some(Some(Cause::Elevation))),
            (&from_mirror, false, Some(Some(Cause::FromMirror))),
        ] {
            assert_eq!(cause(rows, indexed), expected, "{rows:?} {indexed}");
        }
    }
}
