//! The residual of a fit.

use serde::{Deserialize, Serialize};

use super::implausible::Implausible;
use super::status::Status;
use crate::model::Sample;
use crate::model::loss::cosine_weighted_log_error;

/// The residual of a fit.
///
/// It cannot detect readings that were multiplied by the cosine by mistake, because a fit explains them equally well.
/// [`gonio::tile`](crate::gonio::tile) detects this with a tile of known reflectance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Residual {
    /// The mean cosine-weighted logarithmic error over the readings of the fit. It is not comparable with the expected
    /// loss, which is a mean over all directions. It is implausible if it exceeds both 0.25 and 60 times the expected
    /// loss.
    pub mean: f32,
    /// Index of the reading with the largest error.
    pub worst_index: u16,
    /// The largest error.
    pub worst: f32,
    /// Number of saturated readings.
    pub saturated: u16,
    /// Number of readings that equal the previous one in the pattern, bit for bit. A real sensor is too noisy for that.
    /// If all readings but the first are repeated, the sensor is stuck.
    pub repeated: u16,
    /// Number of readings that were too far below 0 for the loss. The fit has clamped them.
    pub clamped: u16,
    /// The reason why the fitted material is implausible, if it is.
    pub implausible: Option<Implausible>,
}

/// A residual that is being computed: its mean is still a sum.
#[derive(Default)]
pub(super) struct ResidualSum {
    pub(super) residual: Residual,
    /// Number of added readings, without the omitted ones.
    pub(super) read: u16,
    /// The sum of each channel, sr^-1.
    pub(super) channels: [f32; 3],
    /// The minimum of each channel, sr^-1.
    pub(super) minima: [f32; 3],
}

impl ResidualSum {
    /// Counts a reading that the fit omitted because of saturation.
    pub(super) fn add_omitted(&mut self, status: Status) {
        let saturated = &mut self.residual.saturated;
        *saturated = saturated.saturating_add(u16::from(status.is_saturated()));
    }

    /// Adds a reading, and the fit's BRDF for it in sr^-1, not times the cosine.
    #[inline(never)] // compiled once, not once per model
    pub(super) fn add(
        &mut self,
        index: u16,
        sample: &Sample<f32>,
        status: Status,
        modeled: [f32; 3],
    ) {
        let residual = &mut self.residual;
        let cosine = sample.at.cos_theta_i();
        let loss = cosine_weighted_log_error(sample.measured, modeled, cosine, 1.0 / 3.0);
        let mut error = loss.error.value();
        // micromath's logarithms of infinities and NaNs are finite.
        if !modeled.iter().all(|f| f.is_finite()) {
            error = f32::NAN;
        }
        residual.mean += error;
        if error > residual.worst {
            residual.worst = error;
            residual.worst_index = index;
        }
        let count = |sum: u16, flag: bool| sum.saturating_add(u16::from(flag));
        residual.repeated = count(residual.repeated, status.is_repeated());
        residual.saturated = count(residual.saturated, status.is_saturated());
        residual.clamped = count(residual.clamped, status.is_clamped());
        let is_first = self.read == 0;
        self.read = self.read.saturating_add(1);
        let sums = self.channels.iter_mut().zip(&mut self.minima);
        for ((sum, minimum), value) in sums.zip(sample.measured) {
            *sum += value;
            if is_first || value < *minimum {
                *minimum = value;
            }
        }
    }
}
