//! The samples of a pattern to which rows of readings belong.

use std::f64::consts::TAU;

use glimpse_core::geometry::{Angles, Directions};
use glimpse_materials::basis::angles_to_f64;

use super::angles::to_directions;
use super::matching::{AngularDistance, IsotropicAngles};
use super::reading_row::ReadingRow;
use super::rows::Rows;
use super::table::TableError;

/// The largest distance of a row from its sample, in degrees: a typical error of a lab's arms.
const TOLERANCE_DEGREES: f64 = 0.5;
const TOLERANCE: f64 = TOLERANCE_DEGREES.to_radians();

/// A row and its sample in the pattern.
pub(super) struct MatchedRow<'r> {
    pub(super) row: &'r ReadingRow,
    pub(super) sample: usize,
    /// The row's own directions, or else those of the sample.
    pub(super) directions: Directions<f32>,
    /// The distance of the row's directions from the sample's; None if the row has only an index.
    pub(super) distance: Option<AngularDistance>,
}

/// A likely cause of rows that match no sample: the correction of the angles, and the text of an error.
type Cause = (fn(&IsotropicAngles) -> IsotropicAngles, &'static str);

const CAUSES: [Cause; 4] = [
    (
        IsotropicAngles::from_surface,
        "the polar angles are measured from the surface; give --convention elevation",
    ),
    (
        IsotropicAngles::opposite,
        "the azimuth of the sensor is 0 in the mirror direction; give --convention from-mirror",
    ),
    (
        IsotropicAngles::exchanged,
        "light and sensor are exchanged; exchange their columns",
    ),
    (
        IsotropicAngles::mirrored,
        "the azimuths have the opposite sense; negate phi_i and phi_o (or phi_d, or y of vectors)",
    ),
];

impl Rows {
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
            Ok(MatchedRow {
                row,
                sample,
                directions: to_directions(row.angles.unwrap_or(pattern[sample])),
                distance,
            })
        });
        matched.collect()
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
        let angles = IsotropicAngles::from_angles(angles);
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
        let message = format!(
            "its directions are not those of {target} (theta_i {theta_i}, theta_o {theta_o}, phi_o - phi_i {phi} \
             degrees): they are {distance}, and at most {TOLERANCE_DEGREES} degrees are accepted"
        );
        match self.cause(samples) {
            Some(cause) => {
                let count = self.rows.len();
                let message = format!("{message}. All {count} rows match if {cause}");
                Err(self.line_error(row.line, &message))
            }
            None if row.index.is_none() => Err(TableError::OffPattern {
                path: self.path.clone(),
                message: format!("{} {}, {message}", self.row_label, row.line),
            }),
            None => Err(self.line_error(
                row.line,
                &format!(
                    "{message}; correct the row (`trainer inspect` prints the recipe's directions), or remove the column index"
                ),
            )),
        }
    }

    /// Returns the text of the first cause that explains all rows.
    fn cause(&self, samples: &[IsotropicAngles]) -> Option<&'static str> {
        let is_cause = |(correct, _): &&Cause| {
            let matches = |row: &ReadingRow, angles| {
                nearest(row, correct(&IsotropicAngles::from_angles(angles)), samples)
                    .is_some_and(|(_, distance)| distance.radians <= TOLERANCE)
            };
            let mut rows = self.rows.iter();
            rows.all(|row| row.angles.is_none_or(|angles| matches(row, angles)))
        };
        let cause = CAUSES.iter().find(is_cause);
        cause.map(|(_, text)| *text)
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

/// Rounds to two decimals.
fn round(degrees: f64) -> f64 {
    (degrees * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::angles::from_spherical;

    /// theta_i, phi_i, theta_o, phi_o in degrees.
    const PATTERN: [[f64; 4]; 3] = [
        [20.0, 0.0, 50.0, 70.0],
        [40.0, 0.0, 40.0, 110.0],
        [30.0, 0.0, 60.0, 180.0],
    ];

    /// Returns the likely cause of rows that match no sample: None if all rows match, and Some(None) if the cause is
    /// unknown.
    fn cause(rows: &[[f64; 4]], indexed: bool) -> Option<Option<&'static str>> {
        let radians = |row: &[f64; 4]| from_spherical(row.map(f64::to_radians));
        let samples = PATTERN.map(|row| IsotropicAngles::from_angles(radians(&row)));
        let rows = rows.iter().enumerate().map(|(index, row)| ReadingRow {
            index: indexed.then_some(index),
            angles: Some(radians(row)),
            ..ReadingRow::default()
        });
        let mut all = Rows::from_readings(&[], &[]);
        all.rows = rows.collect();
        let mut each = all.rows.iter();
        let any = each.any(|row| all.find_sample(row, &samples).is_err());
        any.then(|| all.cause(&samples))
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
        let [surface, opposite, reversed, negated] = CAUSES.map(|(_, text)| Some(Some(text)));
        for (rows, indexed, expected) in [
            (&PATTERN[..], false, None),
            (&PATTERN, true, None),
            (&mirrored, false, negated),
            (&mirrored, true, negated),
            // In the plane of incidence, mirrored rows match.
            (&mirrored[2..], false, None),
            (&unrelated, false, Some(None)),
            (&unrelated, true, Some(None)),
            (&exchanged, false, reversed),
            (&exchanged, true, reversed),
            // If theta_i equals theta_o, mirroring and exchanging give the same angles.
            (&mirrored[1..2], false, reversed),
            (&mirrored[..2], false, negated),
            (&elevations, false, surface),
            (&from_mirror, false, opposite),
        ] {
            assert_eq!(cause(rows, indexed), expected, "{rows:?} {indexed}");
        }
    }
}
