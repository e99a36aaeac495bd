//! The measurements of a pattern's samples.

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Repeated;

use super::matching::AngularDistance;
use super::quantity::ReadingQuantity;
use super::rows::Rows;
use super::table::TableError;

/// The readings of each sample of a pattern.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// The repeated readings of each sample, as BRDFs in linear RGB, sr^-1; empty if the sample is missing.
    pub samples: Vec<Repeated>,
    /// The wavelengths of bands in nm, in ascending order; empty without bands.
    pub wavelengths: Vec<f32>,
    /// The mean BRDF of each sample in each band, sr^-1; empty if the sample is missing.
    pub spectra: Vec<Vec<f32>>,
    /// The number of rows with a reading.
    pub rows: usize,
    /// The largest distance of a row's directions from its sample's; None if no row has directions.
    pub max_distance: Option<AngularDistance>,
}

impl Measurements {
    /// Takes the readings of a pattern. Rows may be in any order, and samples may be missing or repeated. A row with an
    /// index belongs to the sample of that index, and any other row to the nearest sample, which must be within 0.5
    /// degrees. Angles of the pattern are in radians.
    ///
    /// # Errors
    /// If a row matches no sample, its numbers are not a valid reading, or all readings are empty.
    pub fn new(
        rows: &Rows,
        pattern: &[Angles<f32>],
        quantity: &ReadingQuantity,
    ) -> Result<Self, TableError> {
        rows.check_quantity(quantity.name())?;
        let mut measurements = Self {
            samples: vec![Repeated::new(); pattern.len()],
            wavelengths: rows.wavelengths().to_vec(),
            spectra: vec![Vec::new(); pattern.len()],
            rows: 0,
            max_distance: None,
        };
        for matched in rows.match_to_pattern(pattern)? {
            let Some(values) = matched.row.values else {
                continue;
            };
            let bands = quantity.bands_to_brdf(rows, &matched)?;
            let spectrum = &mut measurements.spectra[matched.sample];
            spectrum.resize(bands.len(), 0.0);
            spectrum
                .iter_mut()
                .zip(bands)
                .for_each(|(sum, band)| *sum += band);
            let reading = quantity.to_brdf(rows, &matched, values)?;
            let error = |error| rows.reading_error(matched.row.line, error, values);
            reading.check(matched.sample as u16).map_err(error)?;
            measurements.samples[matched.sample]
                .add(reading.brdf, reading.saturated)
                .map_err(error)?;
            measurements.rows += 1;
            let is_larger = |distance: &AngularDistance| {
                measurements
                    .max_distance
                    .is_none_or(|max| distance.radians > max.radians)
            };
            if let Some(distance) = matched.distance.filter(is_larger) {
                measurements.max_distance = Some(distance);
            }
        }
        for (spectrum, sample) in measurements.spectra.iter_mut().zip(&measurements.samples) {
            let count = sample.count() as f32;
            spectrum.iter_mut().for_each(|sum| *sum /= count);
        }
        if measurements.rows == 0 {
            return Err(
                rows.file_error("all of its rows are empty; give a file with readings".to_owned())
            );
        }
        Ok(measurements)
    }

    /// Returns true if a sample has a reading that is not saturated.
    pub(super) fn any_unsaturated(&self) -> bool {
        let mut samples = self.samples.iter();
        samples.any(|sample| sample.count() > 0 && !sample.saturated())
    }

    /// Returns the indices of the samples without a reading.
    #[must_use]
    pub fn missing(&self) -> Vec<usize> {
        let samples = self.samples.iter().enumerate();
        let missing = samples.filter(|(_, sample)| sample.count() == 0);
        missing.map(|(index, _)| index).collect()
    }
}

/// Returns the coefficient of variation of repeated readings: the sum of the channels' standard deviations divided by
/// the sum of their means. None if there are fewer than two readings or the sum of the means is not above 0.
#[must_use]
pub fn coefficient_of_variation(repeated: &Repeated) -> Option<f32> {
    let (mean, variance) = (repeated.mean()?, repeated.variance()?);
    let mean: f32 = mean.iter().sum();
    let deviation: f32 = variance.iter().map(|variance| variance.sqrt()).sum();
    (mean > 0.0).then(|| deviation / mean)
}
