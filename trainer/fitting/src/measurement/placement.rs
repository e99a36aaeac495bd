//! The samples to which rows of readings belong: those of a pattern, or their own directions.

use std::collections::HashMap;

use glimpse_core::geometry::{Angles, Arms};

use super::conventions::AngleConvention;
use super::distance::AngularDistance;
use super::instrument::Geometry;
use super::rows::{LabReading, ReadingRows};
use super::table::TableError;
use crate::choice::Choice;
use crate::route::{arms_at, arms_in_degrees};

/// The largest distance of a row from its sample, in degrees: a typical error of a lab's arms.
const TOLERANCE: f64 = 0.5;

/// The samples of all rows.
pub(super) struct Placement {
    /// The geometry of the samples.
    pub(super) places: Vec<Geometry>,
    /// The index of each row's sample.
    pub(super) of_rows: Vec<usize>,
    /// The largest distance of a row's directions from its sample's; None if no row has directions of a pattern.
    pub(super) max_distance: Option<AngularDistance>,
}

/// Conventions that are likely causes of rows that match no sample.
const CAUSES: [AngleConvention; 4] = [
    AngleConvention::Elevation,
    AngleConvention::FromMirror,
    AngleConvention::Exchanged,
    AngleConvention::Travel,
];

/// An error of a row that matches no sample.
pub(super) struct Unmatched {
    /// The line, its distance from the nearest sample, and the likely cause.
    pub(super) message: String,
    /// True if its directions are probably not meant to be those of a sample.
    pub(super) is_off_pattern: bool,
}

impl ReadingRows {
    /// Matches each row to the nearest sample, within [`TOLERANCE`].
    ///
    /// # Errors
    /// The first row that matches no sample.
    pub(super) fn match_to_pattern(
        &self,
        directions: Vec<Angles<f32>>,
    ) -> Result<Placement, Unmatched> {
        let arms: Vec<_> = directions.iter().copied().map(arms_in_degrees).collect();
        let mut of_rows = Vec::with_capacity(self.readings.len());
        let mut max_distance: Option<AngularDistance> = None;
        for row in &self.readings {
            let (sample, distance) = self.find_sample(row, &arms)?;
            of_rows.push(sample);
            if let Some(distance) = distance
                && max_distance.is_none_or(|max| distance.degrees > max.degrees)
            {
                max_distance = Some(distance);
            }
        }
        Ok(Placement {
            places: directions.into_iter().map(Geometry::exact).collect(),
            of_rows,
            max_distance,
        })
    }

    /// Takes the different directions and instruments of the rows as samples, in their order.
    ///
    /// # Errors
    /// The first row without directions, with one that is not above the horizon, or with others than the instrument's.
    pub(super) fn own_samples(&self) -> Result<Placement, TableError> {
        let mut places = Vec::new();
        let mut known = HashMap::new();
        let mut of_rows = Vec::with_capacity(self.readings.len());
        for row in &self.readings {
            let error = |message: &str| self.line_error(row.line, message);
            let optics = row.optics;
            if optics.fixed().is_none() && row.angles.is_none() {
                let message =
                    "it has no directions, and this recipe has no pattern; give the directions";
                return Err(error(message));
            }
            let geometry = optics.geometry(row.angles);
            let geometry = geometry.ok_or_else(|| error(&self.horizon_defect()))?;
            let own = arms_in_degrees(geometry.angles);
            let distance = row
                .angles
                .map(|stated| AngularDistance::between(&arms_at(stated), &own));
            if optics.fixed().is_some() && distance.is_some_and(|one| one.degrees > TOLERANCE) {
                let message = "its instrument determines the directions, which are others; leave the angles empty";
                return Err(error(message));
            }
            let bits = geometry.angles.to_array().map(f32::to_bits);
            let key = (bits, optics.instrument, optics.spread.map(f64::to_bits));
            let sample = *known.entry(key).or_insert(places.len());
            if sample == places.len() {
                places.push(geometry);
            }
            of_rows.push(sample);
        }
        Ok(Placement {
            places,
            of_rows,
            max_distance: None,
        })
    }

    /// Returns the defect of a row with a direction that is not above the horizon, and the conventions with which all are.
    fn horizon_defect(&self) -> String {
        let causes = [AngleConvention::Elevation, AngleConvention::Travel];
        let causes = causes.into_iter().filter_map(|cause| self.toggled(cause));
        let causes: Vec<String> = causes.map(|(remedy, _)| remedy).collect();
        let causes = match causes.join(", or ") {
            none if none.is_empty() => none,
            causes => format!(". All directions are above it if {causes}"),
        };
        format!("a direction is not above the horizon; correct the row or remove it{causes}")
    }

    /// Returns the remedy of giving a convention, or removing it, and the directions of the rows with it. None if one is not
    /// above the horizon then.
    fn toggled(&self, convention: AngleConvention) -> Option<(String, Vec<Option<Angles<f64>>>)> {
        let args = self.angle_args.toggled(convention);
        let is_given = args.has(convention);
        let verb = if is_given { "give" } else { "remove" };
        let remedy = format!("you {verb} --convention {}", convention.name());
        Some((remedy, self.reread(&args)?))
    }

    /// Finds the sample of a row. Returns it with its distance, if the row has directions.
    fn find_sample(
        &self,
        row: &LabReading,
        samples: &[Arms<f64>],
    ) -> Result<(usize, Option<AngularDistance>), Unmatched> {
        let unmatched = |message: &str, is_off_pattern: bool| {
            let message = self.at_line(row.line, message);
            Err(Unmatched {
                message,
                is_off_pattern,
            })
        };
        let error = |message: &str| unmatched(message, false);
        if row.optics.fixed().is_some() || row.optics.spread != [0.0; 2] {
            let message = "its reading is a mean over an aperture, and those of the recipe's samples are at exact directions";
            return unmatched(message, true);
        }
        let count = samples.len();
        if let Some(index) = row.index.filter(|index| *index >= count) {
            return error(&format!(
                "column index: {index} is out of range; the recipe has {count} samples, give 0 to {}",
                count - 1
            ));
        }
        let Some(angles) = row.angles else {
            return match row.index {
                Some(index) => Ok((index, None)),
                None => error("the directions and the index are missing; give one of them"),
            };
        };
        let arms = arms_at(angles);
        let Some((sample, distance)) = nearest(row.index, &arms, samples) else {
            return error("the recipe has no samples; give another recipe");
        };
        if distance.degrees <= TOLERANCE {
            return Ok((sample, Some(distance)));
        }
        let target = match (row.index, nearest(None, &arms, samples)) {
            (Some(_), Some((nearest, _))) if nearest != sample => {
                format!("sample {sample}, the row's index (sample {nearest} is nearer)")
            }
            (Some(_), _) => format!("sample {sample}, the row's index"),
            (None, _) => format!("sample {sample}, the nearest"),
        };
        let at = samples[sample];
        let [theta_i, theta_o, phi] = [
            at.theta_i,
            at.theta_o,
            (at.phi_o - at.phi_i).rem_euclid(360.0),
        ]
        .map(|angle| (angle * 100.0).round() / 100.0);
        let message = format!(
            "its directions are not those of {target} (theta_i {theta_i}, theta_o {theta_o}, phi_o - phi_i {phi} \
             degrees): they are {:.2} degrees off in {}, and at most {TOLERANCE} degrees are accepted",
            distance.degrees, distance.angle
        );
        match self.cause(samples) {
            Some(cause) => {
                let count = self.readings.len();
                error(&format!("{message}. All {count} rows match if {cause}"))
            }
            None if row.index.is_none() => unmatched(&message, true),
            None => error(&format!(
                "{message}; correct the row (`trainer inspect` prints the recipe's directions), or remove the column index"
            )),
        }
    }

    /// Returns the remedy of the first cause that explains all rows.
    fn cause(&self, samples: &[Arms<f64>]) -> Option<String> {
        let all_match = |rows: &[Option<Angles<f64>>], correct: fn(Arms<f64>) -> Arms<f64>| {
            let mut rows = self.readings.iter().zip(rows);
            rows.all(|(row, angles)| {
                angles.is_none_or(|angles| {
                    nearest(row.index, &correct(arms_at(angles)), samples)
                        .is_some_and(|(_, distance)| distance.degrees <= TOLERANCE)
                })
            })
        };
        let mut causes = CAUSES.into_iter().filter_map(|cause| self.toggled(cause));
        if let Some((remedy, _)) = causes.find(|(_, angles)| all_match(angles, |arms| arms)) {
            return Some(remedy);
        }
        // In the plane of incidence, where phi_o - phi_i is 0 or 180 degrees, the directions stay the same. Elsewhere they
        // change, but a mirror-symmetric material has the same BRDF.
        let negated = |arms: Arms<f64>| Arms {
            phi_i: -arms.phi_i,
            phi_o: -arms.phi_o,
            ..arms
        };
        let angles: Vec<_> = self.readings.iter().map(|row| row.angles).collect();
        all_match(&angles, negated)
            .then(|| "you negate phi_i and phi_o (or phi_d, or y of vectors)".to_owned())
    }
}

/// Returns the sample of an index and its distance from a position, or else the nearest sample. None if the index is out of
/// range, or `samples` is empty.
fn nearest(
    index: Option<usize>,
    arms: &Arms<f64>,
    samples: &[Arms<f64>],
) -> Option<(usize, AngularDistance)> {
    if let Some(index) = index {
        return Some((index, AngularDistance::between(arms, samples.get(index)?)));
    }
    let distances = samples
        .iter()
        .map(|sample| AngularDistance::between(arms, sample));
    distances
        .enumerate()
        .min_by(|(_, one), (_, other)| one.degrees.total_cmp(&other.degrees))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::angles::{rusinkiewicz, vector};

    /// theta_i, phi_i, theta_o, phi_o in degrees.
    const PATTERN: [[f64; 4]; 3] = [
        [20.0, 0.0, 50.0, 70.0],
        [40.0, 0.0, 40.0, 110.0],
        [30.0, 0.0, 60.0, 180.0],
    ];

    /// Returns the likely cause of rows that match no sample: None if all rows match, and Some(None) if the cause is
    /// unknown.
    fn cause(rows: &[[f64; 4]], indexed: bool) -> Option<Option<String>> {
        let radians = |row: &[f64; 4]| {
            let [theta_i, phi_i, theta_o, phi_o] = row.map(f64::to_radians);
            rusinkiewicz(vector(theta_i, phi_i), vector(theta_o, phi_o))
        };
        let samples = PATTERN.map(|row| arms_at(radians(&row)));
        let rows = rows.iter().enumerate().map(|(index, row)| LabReading {
            index: indexed.then_some(index),
            angles: Some(radians(row)),
            numbers: vec![1.0; 3],
            ..LabReading::default()
        });
        let all = ReadingRows::from_array("rows", Vec::new(), rows.collect());
        let mut readings = all.readings.iter();
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
        let [surface, opposite, reversed, against] = CAUSES.map(|cause| Some(Some(cause.name())));
        let negated = Some(Some("negate".to_owned()));
        let travel = PATTERN.map(|[theta_i, phi_i, theta_o, phi_o]| {
            [180.0 - theta_i, phi_i + 180.0, theta_o, phi_o]
        });
        for (rows, indexed, expected) in [
            (&PATTERN[..], false, None),
            (&PATTERN, true, None),
            (&mirrored, false, negated.clone()),
            (&mirrored, true, negated.clone()),
            // In the plane of incidence, mirrored rows match.
            (&mirrored[2..], false, None),
            (&unrelated, false, Some(None)),
            (&unrelated, true, Some(None)),
            (&exchanged, false, reversed.clone()),
            (&exchanged, true, reversed.clone()),
            // If theta_i equals theta_o, mirroring and exchanging give the same angles.
            (&mirrored[1..2], false, reversed),
            (&mirrored[..2], false, negated),
            (&elevations, false, surface),
            (&from_mirror, false, opposite),
            (&travel, true, against),
        ] {
            let cause = cause(rows, indexed);
            let is_expected = match (&cause, &expected) {
                (Some(Some(text)), Some(Some(word))) => text.contains(word),
                _ => cause == expected,
            };
            assert!(is_expected, "{rows:?} {indexed} {cause:?} {expected:?}");
        }
    }

    #[test]
    fn finds_nearest_sample() {
        let angles = Angles {
            theta_h: 0.0,
            theta_d: 0.6,
            phi_d: 1.0,
        };
        let mirror = arms_at(angles);
        let theta = 0.6_f64.to_degrees();
        let expected = Arms::from_array([theta, 0.0, theta, 180.0]);
        let distance = AngularDistance::between(&mirror, &expected);
        assert!(distance.degrees < 1e-9, "{mirror:?}");
        let samples = [Arms::from_array([1.0, 0.0, 1.0, 0.0]), expected];
        assert_eq!(nearest(None, &mirror, &samples).unwrap().0, 1);
        assert!(nearest(None, &mirror, &[]).is_none());
    }
}
