//! What was read of each sample of a pattern.

use std::path::Path;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Repeated;
use glimpse_core::scan::Reading;

use super::matching::Distance;
use super::quantity::Meaning;
use super::rows::{Rows, Taken};
use super::table::TableError;

/// What was read of each sample of a pattern.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Readings of each sample, as BRDFs in linear RGB and sr^-1; none where it is missing.
    pub samples: Vec<Repeated>,
    /// Rows in which something was read.
    pub rows: usize,
    /// The row whose directions are furthest from its sample's; None if none says its directions.
    pub furthest: Option<Distance>,
}

impl Measured {
    /// Reads a file of readings at a pattern, angles in radians: rows in any order, some missing,
    /// some repeated. Each belongs to the nearest sample, no further away than `tolerance`, radians,
    /// or to the one that it names.
    ///
    /// # Errors
    /// If the file cannot be read, a row is of no sample, or its numbers are no reading.
    pub fn read(
        path: &Path,
        pattern: &[Angles<f32>],
        tolerance: f64,
        meaning: &Meaning,
    ) -> Result<Self, TableError> {
        Self::matched(&Rows::read(path)?, pattern, tolerance, meaning)
    }

    /// The same of readings that stand in no file; errors name them by their places among all, from 0.
    ///
    /// # Errors
    /// If a reading is of no sample, or its numbers are no reading, or there is none.
    pub fn of(
        taken: &[Taken],
        pattern: &[Angles<f32>],
        tolerance: f64,
        meaning: &Meaning,
    ) -> Result<Self, TableError> {
        Self::matched(&Rows::of(taken), pattern, tolerance, meaning)
    }

    fn matched(
        rows: &Rows,
        pattern: &[Angles<f32>],
        tolerance: f64,
        meaning: &Meaning,
    ) -> Result<Self, TableError> {
        rows.refuse_other_than(meaning.name())?;
        let mut measured = Self {
            samples: vec![Repeated::new(); pattern.len()],
            rows: 0,
            furthest: None,
        };
        for row in rows.matched(pattern, tolerance)? {
            let Some(values) = row.values else {
                continue;
            };
            let read = meaning.brdf(&row, values);
            let wrong = |what: String| {
                rows.wrong(row.line, &format!("{what}; correct the row or remove it"))
            };
            let read = read.map_err(wrong)?;
            let reading = Reading::from(read);
            reading.check().map_err(|error| wrong(error.to_string()))?;
            measured.samples[row.sample]
                .add(reading.brdf, reading.saturated)
                .map_err(|error| wrong(error.to_string()))?;
            measured.rows += 1;
            let further = |far: &Distance| {
                measured
                    .furthest
                    .is_none_or(|furthest| far.largest > furthest.largest)
            };
            if let Some(far) = row.distance.filter(further) {
                measured.furthest = Some(far);
            }
        }
        if measured.rows == 0 {
            return Err(rows.damaged(
                "nothing was read in any of its rows; give a file with readings".to_owned(),
            ));
        }
        Ok(measured)
    }

    /// Which samples are missing.
    #[must_use]
    pub fn missing(&self) -> Vec<usize> {
        let all = self.samples.iter().enumerate();
        let missing = all.filter(|(_, sample)| sample.count() == 0);
        missing.map(|(index, _)| index).collect()
    }
}

/// How much repeated readings vary: their standard deviation by their mean, over all channels. None
/// of fewer than two, and where the mean is not above 0.
#[must_use]
pub fn spread(repeated: &Repeated) -> Option<f32> {
    let (mean, variance) = (repeated.mean()?, repeated.variance()?);
    let mean: f32 = mean.iter().sum();
    let deviation: f32 = variance.iter().map(|variance| variance.sqrt()).sum();
    (mean > 0.0).then(|| deviation / mean)
}
