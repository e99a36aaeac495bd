//! The posterior of readings in bands.
//!
//! There is a prior for the mean of the channels, and one for their differences from it. That of the mean takes the mean over all
//! bands, and that of the differences the difference of each band.

use glimpse_core::model::linear::{map, unmap};
use nalgebra::DMatrix;

use super::posterior::{Posterior, PosteriorReading, differences_from};

impl Posterior {
    /// Returns the posterior of the same readings in bands: `bands` has the BRDFs of each reading, sr^-1, not times the cosine, or
    /// their means over its aperture.
    pub fn of_bands(&self, bands: &[Vec<f32>]) -> Self {
        let centers = &self.design.at.centers;
        self.of_mapped(bands, |reading, band| {
            let center = f64::from(centers[reading].iter().sum::<f32>()) / 3.0;
            self.mapped_band(bands, reading, band) - center
        })
    }

    /// Returns the posterior after the differences of `bands` from `fitted` ones were added to the mapped values.
    pub fn corrected(&self, bands: &[Vec<f32>], fitted: &[Vec<f32>]) -> Self {
        let [mean, differences] = &self.targets;
        self.of_mapped(bands, |reading, band| {
            let error =
                self.mapped_band(bands, reading, band) - self.mapped_band(fitted, reading, band);
            mean[(reading, 0)] + differences[(reading, band)] + error
        })
    }

    fn mapped_band(&self, bands: &[Vec<f32>], reading: usize, band: usize) -> f64 {
        f64::from(map(
            bands[reading][band].max(0.0),
            self.design.at.cosines[reading],
        ))
    }

    fn of_mapped(&self, bands: &[Vec<f32>], mapped: impl Fn(usize, usize) -> f64) -> Self {
        let count = bands.first().map_or(0, Vec::len);
        let mapped = DMatrix::from_fn(bands.len(), count, mapped);
        let targets = differences_from(mapped.column_mean(), mapped);
        Self::of_targets(targets, self.design.clone())
    }

    /// Returns the posterior of three channels whose red one is a band, and whose mean is that of all bands, and its readings.
    pub fn with_red(
        &self,
        band: usize,
        readings: &[PosteriorReading],
    ) -> (Self, Vec<PosteriorReading>) {
        let [mean, differences] = &self.targets;
        let own = differences.column(band);
        let columns = [own.into_owned(), -own, 0.0 * own];
        let targets = [mean.clone(), DMatrix::from_columns(&columns)];
        let at = &self.design.at;
        let readings = readings.iter().enumerate().map(|(i, reading)| {
            let brdf = [0, 1, 2].map(|channel: usize| {
                let target = targets[0][(i, 0)] + targets[1][(i, channel)];
                let center = f64::from(at.centers[i][channel]);
                unmap(center + target, f64::from(at.cosines[i])) as f32
            });
            let reading = reading.clone();
            PosteriorReading { brdf, ..reading }
        });
        let readings = readings.collect();
        (Self::of_targets(targets, self.design.clone()), readings)
    }
}
