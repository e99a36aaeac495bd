//! The samples to which rows of readings belong: those of a pattern, or their own directions.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glimpse_core::geometry::Angles;

use super::angles::above_horizon;
use super::matching::{AngularDistance, IsotropicAngles};
use super::rows::{LabReading, Rows};
use super::table::TableError;

/// The largest distance of a row from its sample, in degrees: a typical error of a lab's arms.
const TOLERANCE_DEGREES: f64 = 0.5;
const TOLERANCE: f64 = TOLERANCE_DEGREES.to_radians();

/// The samples of all rows.
pub(super) struct Placement {
    /// The directions of the samples, in radians.
    pub(super) directions: Vec<Angles<f32>>,
    /// The standard deviation of the mean reading's noise at each of a row's own directions, relative to the reading.
    pub(super) noise: Vec<f32>,
    /// The index of each row's sample.
    pub(super) of_rows: Vec<usize>,
    /// The largest distance of a row's directions from its sample's; None if no row has directions of a pattern.
    pub(super) max_distance: Option<AngularDistance>,
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
        pattern: impl Iterator<Item = Angles<f32>>,
    ) -> Result<Placement, TableError> {
        let directions: Vec<Angles<f32>> = pattern.collect();
        let angles = directions.iter().map(|angles| angles.map(f64::from));
        let angles: Vec<IsotropicAngles> = angles.map(IsotropicAngles::from_angles).collect();
        let mut of_rows = Vec::with_capacity(self.readings().len());
        let mut max_distance: Option<AngularDistance> = None;
        for row in self.readings() {
            let (sample, distance) = self.find_sample(row, &angles)?;
            of_rows.push(sample);
            if let Some(distance) = distance
                && max_distance.is_none_or(|max| distance.radians > max.radians)
            {
                max_distance = Some(distance);
            }
        }
        Ok(Placement {
            noise: vec![0.0; directions.len()],
            directions,
            of_rows,
            max_distance,
        })
    }

    /// Takes the different directions of the rows as samples, in their order.
    ///
    /// # Errors
    /// The first row without directions, or with one that is not above the horizon.
    pub(super) fn own_samples(&self) -> Result<Placement, TableError> {
        let mut directions = Vec::new();
        let mut known: HashMap<[u32; 3], usize> = HashMap::new();
        let mut of_rows = Vec::with_capacity(self.readings().len());
        // Sums of variances, and numbers of readings.
        let mut noise: Vec<(f32, f32)> = Vec::new();
        for row in self.readings() {
            let error = |message| self.line_error(row.line, message);
            let angles = row.angles.ok_or_else(|| {
                error("it has an index, but this recipe has no pattern; give the directions")
            })?;
            let angles = above_horizon(angles).ok_or_else(|| {
                error("a direction is not above the horizon; correct the row or remove it")
            })?;
            let bits = angles.to_array().map(f32::to_bits);
            let sample = *known.entry(bits).or_insert(directions.len());
            if sample == directions.len() {
                directions.push(angles);
                noise.push((0.0, 0.0));
            }
            noise[sample].0 += row.noise.unwrap_or_default().powi(2);
            noise[sample].1 += 1.0;
            of_rows.push(sample);
        }
        let noise = noise.iter().map(|(sum, count)| sum.sqrt() / count);
        Ok(Placement {
            noise: noise.collect(),
            directions,
            of_rows,
            max_distance: None,
        })
    }

    /// Refuses rows that state their noise, which only a recipe without a pattern takes into account.
    pub(super) fn refuse_noise(&self) -> Result<(), TableError> {
        match self.readings().iter().find(|row| row.noise.is_some()) {
            None => Ok(()),
            Some(row) => Err(self.line_error(
                row.line,
                "column noise: it has no effect with a recipe for its own directions; remove it, or fit with a recipe of \
                 `--samples any`",
            )),
        }
    }

    /// Finds the sample of a row. Returns it with its distance, if the row has directions.
    fn find_sample(
        &self,
        row: &LabReading,
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
                let count = self.readings().len();
                let message = format!("{message}. All {count} rows match if {cause}");
                Err(self.line_error(row.line, &message))
            }
            None if row.index.is_none() => Err(TableError::OffPattern {
                path: self.path.clone(),
                message: self.at_line(row.line, &message),
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
            let matches = |row: &LabReading, angles| {
                nearest(row, correct(&IsotropicAngles::from_angles(angles)), samples)
                    .is_some_and(|(_, distance)| distance.radians <= TOLERANCE)
            };
            let mut rows = self.readings().iter();
            rows.all(|row| row.angles.is_none_or(|angles| matches(row, angles)))
        };
        let cause = CAUSES.iter().find(is_cause);
        cause.map(|(_, text)| *text)
    }
}

/// Returns the sample of a row with these angles and its distance: the sample of the row's index, or else the nearest one.
/// None if the index is out of range.
fn nearest(
    row: &LabReading,
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
        let rows = rows.iter().enumerate().map(|(index, row)| LabReading {
            index: indexed.then_some(index),
            angles: Some(radians(row)),
            numbers: vec![1.0; 3],
            ..LabReading::default()
        });
        let all = Rows::from_array("rows", Vec::new(), rows.collect());
        let mut readings = all.readings().iter();
        let any = readings.any(|row| all.find_sample(row, &samples).is_err());
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
