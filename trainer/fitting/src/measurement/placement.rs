//! The samples to which rows of readings belong: those of a pattern, or their own directions.

use std::collections::HashMap;

use glimpse_core::geometry::{Angles, Arms};

use super::angles::above_horizon;
use super::conventions::AngleConvention;
use super::rows::{LabReading, ReadingRows};
use super::table::TableError;
use crate::choice::Choice;
use crate::route::{arms_at, arms_in_degrees, wrapped};

/// The largest distance of a row from its sample, in degrees: a typical error of a lab's arms.
const TOLERANCE: f64 = 0.5;

/// The samples of all rows.
pub(super) struct Placement {
    /// The directions of the samples, in radians.
    pub(super) directions: Vec<Angles<f32>>,
    /// The index of each row's sample.
    pub(super) of_rows: Vec<usize>,
    /// The largest distance of a row's directions from its sample's; None if no row has directions of a pattern.
    pub(super) max_distance: Option<AngularDistance>,
}

/// The distance between two pairs of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngularDistance {
    /// The largest difference of the three angles, in degrees.
    pub degrees: f64,
    /// The angle that differs most.
    pub angle: &'static str,
}

impl AngularDistance {
    /// Returns the distance between two positions of the arms in degrees: the largest of three differences. These are the
    /// differences of theta_i, of theta_o, and of phi_o - phi_i times the smallest sine of the polar angles. The sine is
    /// small near the normal, where azimuths matter little.
    #[must_use]
    pub fn between(one: &Arms<f64>, other: &Arms<f64>) -> Self {
        let azimuth = wrapped(one.phi_o - one.phi_i - (other.phi_o - other.phi_i));
        let polar = [one.theta_i, one.theta_o, other.theta_i, other.theta_o];
        let sines = polar.map(|theta| theta.to_radians().sin());
        let differences = [
            ("theta_i", one.theta_i - other.theta_i),
            ("theta_o", one.theta_o - other.theta_o),
            (
                "phi_o - phi_i, scaled by the smallest sine of a polar angle",
                azimuth * sines.into_iter().fold(1.0, f64::min),
            ),
        ];
        let distances = differences.map(|(angle, difference)| Self {
            degrees: difference.abs(),
            angle,
        });
        // NaN counts as the largest distance. Of equal ones, the first counts.
        let distances = distances.into_iter().rev();
        let largest = distances.max_by(|one, other| one.degrees.total_cmp(&other.degrees));
        largest.unwrap_or_default()
    }
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
        let mut of_rows = Vec::with_capacity(self.readings.len());
        for row in &self.readings {
            let error = |message: &str| self.line_error(row.line, message);
            let angles = row.angles.ok_or_else(|| {
                error("it has no directions, and this recipe has no pattern; give the directions")
            })?;
            let angles = above_horizon(angles).ok_or_else(|| error(&self.horizon_defect()))?;
            let bits = angles.to_array().map(f32::to_bits);
            let sample = *known.entry(bits).or_insert(directions.len());
            if sample == directions.len() {
                directions.push(angles);
            }
            of_rows.push(sample);
        }
        Ok(Placement {
            directions,
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
    use crate::measurement::angles::from_spherical;

    /// theta_i, phi_i, theta_o, phi_o in degrees.
    const PATTERN: [[f64; 4]; 3] = [
        [20.0, 0.0, 50.0, 70.0],
        [40.0, 0.0, 40.0, 110.0],
        [30.0, 0.0, 60.0, 180.0],
    ];

    /// Returns the likely cause of rows that match no sample: None if all rows match, and Some(None) if the cause is
    /// unknown.
    fn cause(rows: &[[f64; 4]], indexed: bool) -> Option<Option<String>> {
        let radians = |row: &[f64; 4]| from_spherical(row.map(f64::to_radians));
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

    fn degrees(theta_i: f64, theta_o: f64, phi_o: f64) -> Arms<f64> {
        Arms {
            theta_i,
            phi_i: 0.0,
            theta_o,
            phi_o,
        }
    }

    #[test]
    fn distance_weights_azimuth_by_smallest_sine() {
        let azimuth = Some("phi_o - phi_i");
        for (to, degrees_off, angle) in [
            (degrees(30.2, 60.1, 179.0), 0.2, Some("theta_i")),
            (degrees(30.1, 59.6, 179.0), 0.4, Some("theta_o")),
            // The azimuths differ by 2 degrees, across 180; times sin(30 degrees).
            (degrees(30.0, 60.0, -179.0), 1.0, azimuth),
            (degrees(30.0, 60.0, 179.0 + 720.0), 0.0, Some("theta_i")),
        ] {
            let distance = AngularDistance::between(&degrees(30.0, 60.0, 179.0), &to);
            assert!(
                (distance.degrees - degrees_off).abs() < 1e-6,
                "{distance:?}"
            );
            assert_eq!(distance.angle.split(',').next(), angle);
        }
        // At the normal the azimuth does not matter.
        let normal = AngularDistance::between(&degrees(0.0, 60.0, 0.0), &degrees(0.0, 60.0, 90.0));
        assert!(normal.degrees < 1e-12);
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
        let expected = degrees(theta, theta, 180.0);
        let distance = AngularDistance::between(&mirror, &expected);
        assert!(distance.degrees < 1e-9, "{mirror:?}");
        let samples = [degrees(1.0, 1.0, 0.0), expected];
        assert_eq!(nearest(None, &mirror, &samples).unwrap().0, 1);
        assert!(nearest(None, &mirror, &[]).is_none());
    }
}
