//! The readings of a recipe's samples, and their state in a fit.

use std::sync::Arc;

use crate::linear::{Aperture, DEFAULT_NOISE, LeftOut, PosteriorReading};
use clap::ValueEnum;
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Repeated;
use glimpse_materials::Brdf;
use glimpse_materials::setting::Name;
use serde::Serialize;

use super::angles::to_directions;
use super::clipping::clipped_rows;
use super::distance::AngularDistance;
use super::noise::NoiseSummary;
use super::optics::Optics;
use super::quantity::{Conversion, ReadingQuantity};
use super::recipe::NamedRecipe;
use super::rows::ReadingRows;
use super::table::TableError;

/// The status of a sample's reading in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ReadingStatus {
    /// The fit uses the reading.
    Used,
    /// The sample has no reading.
    Missing,
    /// The fit does not use the reading, because it is saturated.
    Saturated,
    /// The fit does not use the reading, because it is an outlier.
    Outlier,
}

/// The reading of a sample.
#[derive(Clone, Debug)]
pub struct SampleReading {
    /// The directions of the sample, in radians.
    pub angles: Angles<f32>,
    /// The aperture; None for a reading exactly at these directions.
    pub aperture: Option<Arc<Aperture>>,
    /// The instrument.
    pub optics: Optics,
    /// The place of the last of its rows.
    pub place: Option<String>,
    /// The BRDFs of its rows, linear RGB, sr^-1, or their means over the aperture; empty if the sample is missing.
    pub brdf: Repeated,
    /// The mean BRDF in each band, sr^-1; empty without bands, or if the sample is missing.
    pub bands: Vec<f32>,
    /// The standard deviation of the mean reading's noise, relative to the reading.
    pub noise: f32,
    /// True if a number of its rows is probably cut off at the largest value.
    pub is_clipped: bool,
    /// The status. Before the selection of a fit, it is used or missing.
    pub status: ReadingStatus,
    /// The prediction from the other readings; None before the selection, and without a known reading. For an outlier,
    /// it is the prediction just before its removal. For any other reading, it is that after the removal of all outliers.
    pub prediction: Option<LeftOut>,
}

impl SampleReading {
    /// Creates a sample without a reading.
    #[must_use]
    pub fn new(angles: Angles<f32>) -> Self {
        Self {
            angles,
            aperture: None,
            optics: Optics::default(),
            place: None,
            brdf: Repeated::default(),
            bands: Vec::new(),
            noise: DEFAULT_NOISE,
            is_clipped: false,
            status: ReadingStatus::Missing,
            prediction: None,
        }
    }

    /// Returns the mean BRDF, if the fit uses the reading.
    #[must_use]
    pub fn used(&self) -> Option<[f32; 3]> {
        let mean = self.brdf.mean();
        mean.filter(|_| self.status == ReadingStatus::Used)
    }

    /// Returns the reading of a BRDF, as of a fit.
    pub fn of(&self, brdf: &dyn Brdf) -> [f32; 3] {
        let aperture = self.aperture.as_ref();
        aperture.map_or_else(|| brdf.at_angles(self.angles), |one| one.mean(brdf))
    }

    /// Returns the coefficient of variation of repeated readings: the sum of the channels' standard deviations divided by
    /// the sum of their means. None if there are fewer than two readings or the sum of the means is not above 0.
    #[must_use]
    pub fn coefficient_of_variation(&self) -> Option<f32> {
        let (mean, variance) = (self.brdf.mean()?, self.brdf.variance()?);
        let mean: f32 = mean.iter().sum();
        let deviation: f32 = variance.iter().map(|variance| variance.sqrt()).sum();
        (mean > 0.0).then(|| deviation / mean)
    }

    /// Returns the reading for a posterior; None if it is missing.
    pub(super) fn for_posterior(&self) -> Option<PosteriorReading> {
        Some(PosteriorReading {
            angles: self.angles,
            aperture: self.aperture.clone(),
            brdf: self.brdf.mean()?,
            noise: self.noise,
        })
    }
}

/// The readings of each sample of the recipe that fits them.
#[derive(Clone, Debug)]
pub struct Readings {
    /// The recipe: a given one at its own directions, or one without a pattern at those of the readings.
    pub recipe: NamedRecipe,
    /// Their noise; None if the recipe is for its own directions. Its fit has the noise of its training.
    pub noise: Option<NoiseSummary>,
    /// The reason that the given recipe does not fit the readings.
    pub off_pattern: Option<String>,
    /// The samples.
    pub samples: Vec<SampleReading>,
    /// The rows, of which each has a reading.
    pub rows: ReadingRows,
    /// The quantity of their numbers.
    pub quantity: ReadingQuantity,
    /// The sample of each row.
    pub(super) of_rows: Vec<usize>,
    /// The largest distance of a row's directions from its sample's; None if no row has directions of a pattern.
    pub max_distance: Option<AngularDistance>,
}

impl Readings {
    /// Takes the readings of a recipe's samples. Rows may be in any order, and samples may be missing or repeated.
    ///
    /// With a pattern, a row with an index belongs to the sample of that index, and any other row to the nearest sample,
    /// which must be within 0.5 degrees. If rows are at other directions, the bundled recipe of the same model without a
    /// pattern takes its place. Without a pattern, each different pair of directions is a sample.
    ///
    /// # Errors
    /// If rows are of another quantity, have directions whose likely cause is another convention, or are not valid
    /// readings; if all rows are empty.
    pub fn new(
        given: &NamedRecipe,
        rows: ReadingRows,
        quantity: ReadingQuantity,
    ) -> Result<Self, TableError> {
        rows.check_quantity(&quantity.name())?;
        if rows.readings.is_empty() {
            return Err(
                rows.file_error("all of its rows are empty; give a file with readings".to_owned())
            );
        }
        let stated = rows.readings.iter().filter(|row| row.noise.is_some());
        let (stated, all, option) = (stated.count(), rows.readings.len(), Name("noise"));
        if rows.noise.is_some() && stated == all {
            let message = "has no effect, because all rows state their noise; remove it";
            return Err(rows.file_error(format!("{option} {message}")));
        }
        if !given.is_any() && (rows.noise.is_some() || stated > 0) {
            return Err(rows.file_error(format!(
                "a stated noise has no effect with a recipe for its own directions; remove the column noise or {option}, or \
                 fit with a recipe of `--samples any`"
            )));
        }
        let (mut matched, mut off_pattern) = (None, None);
        if !given.is_any() {
            match rows.match_to_pattern(given.file.recipe().pattern().collect()) {
                Ok(placement) => matched = Some(placement),
                Err(unmatched) if unmatched.is_off_pattern => off_pattern = Some(unmatched.message),
                Err(unmatched) => return Err(rows.file_error(unmatched.message)),
            }
        }
        let has_pattern = matched.is_some();
        let placement = matched.map_or_else(|| rows.own_samples(), Ok)?;
        let places = &placement.places;
        let samples = places.iter().map(|place| SampleReading {
            aperture: place.aperture.clone(),
            ..SampleReading::new(place.angles)
        });
        let mut samples: Vec<SampleReading> = samples.collect();
        let directions: Vec<_> = places.iter().map(|place| place.angles).collect();
        let conversion = Conversion::new(&rows, &quantity, &directions)?;
        for (row, index) in rows.readings.iter().zip(&placement.of_rows) {
            let sample = &mut samples[*index];
            sample.optics = row.optics;
            sample.place.clone_from(&row.place);
            let at = to_directions(row.angles.unwrap_or(sample.angles.map(f64::from)));
            let bands = conversion.bands_to_brdf(row, *index, &at)?;
            sample.bands.resize(bands.len(), 0.0);
            for (sum, band) in sample.bands.iter_mut().zip(bands) {
                *sum += band;
            }
            let reading = conversion.to_brdf(row, *index, &at, rows.rgb(row))?;
            reading
                .check(u16::try_from(*index).unwrap_or(u16::MAX))
                .and_then(|()| sample.brdf.add(reading.brdf, reading.saturated))
                .map_err(|error| rows.reading_error(row, error))?;
            sample.status = ReadingStatus::Used;
        }
        let numbers = rows.readings.iter().zip(&placement.of_rows);
        let numbers = numbers.map(|(row, index)| {
            let gloss = row.optics.gloss_unit();
            let others = gloss.map_or(&row.numbers[..], |_| &[]);
            (directions[*index], others)
        });
        let clipped = clipped_rows(&numbers.collect::<Vec<_>>());
        for (index, is_clipped) in placement.of_rows.iter().zip(clipped) {
            samples[*index].is_clipped |= is_clipped;
        }
        for sample in &mut samples {
            let count = sample.brdf.count as f32;
            sample.bands.iter_mut().for_each(|sum| *sum /= count);
        }
        // Saturation hides the variation.
        let known = samples.iter().filter(|sample| !sample.brdf.saturated);
        let variations = known.filter_map(SampleReading::coefficient_of_variation);
        let (noise, deviations) =
            rows.noise_of_samples(&placement.of_rows, samples.len(), variations.collect());
        for (sample, deviation) in samples.iter_mut().zip(&deviations) {
            sample.noise = *deviation;
        }
        let recipe = if has_pattern {
            given.clone()
        } else {
            let recipe = given.continuing().at_geometries(places);
            recipe.map_err(|defect| rows.file_error(defect.to_string()))?
        };
        Ok(Self {
            recipe,
            noise: (!has_pattern).then_some(noise),
            off_pattern,
            samples,
            max_distance: placement.max_distance,
            rows,
            quantity,
            of_rows: placement.of_rows,
        })
    }

    /// Returns the directions of all samples.
    #[must_use]
    pub fn pattern(&self) -> Vec<Angles<f32>> {
        self.samples.iter().map(|sample| sample.angles).collect()
    }

    /// Returns the indices of the samples for which a condition holds.
    pub fn indices(&self, holds: impl Fn(&SampleReading) -> bool) -> Vec<usize> {
        let all = self.samples.iter().enumerate();
        let matching = all.filter(|(_, sample)| holds(sample));
        matching.map(|(index, _)| index).collect()
    }
}

/// Returns the indices of the samples with known readings: those of saturated ones are unknown, unless all are saturated.
pub(super) fn known_readings(samples: &[SampleReading]) -> Vec<usize> {
    let known = samples.iter().enumerate();
    let known = known.filter(|(_, sample)| sample.brdf.count > 0);
    let all_saturated = known.clone().all(|(_, sample)| sample.brdf.saturated);
    let known = known.filter(|(_, sample)| all_saturated || !sample.brdf.saturated);
    known.map(|(index, _)| index).collect()
}
