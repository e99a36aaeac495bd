//! The residual of a fit.

use serde::{Deserialize, Serialize};

use super::implausible::Implausible;
use super::status::Status;
use crate::model::Sample;
use crate::model::loss::cosine_weighted_log_error;

/// The residual of a fit.
///
/// It cannot see a wrong convention: readings that are times the cosine are fitted as well as
/// others. [`gonio::tile`](crate::gonio::tile), on a tile of known reflectance, can.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Residual {
    /// The mean cosine-weighted logarithmic error over the readings of the fit. It is not comparable with the expected
    /// loss, a mean over all directions; it is implausible from 0.25 on if it is also more than 60 times as large.
    pub mean: f32,
    /// The reading that is explained worst.
    pub worst_index: u16,
    /// Its error.
    pub worst: f32,
    /// Number of saturated readings.
    pub saturated: u16,
    /// Number of readings that equal the one before them in the pattern, bit for bit. A real sensor is too
    /// noisy for that; if all but the first were, it is stuck.
    pub repeated: u16,
    /// Number of readings that were too far below 0 for the loss, and were raised.
    pub clamped: u16,
    /// Why the fitted material is implausible, if it is.
    pub implausible: Option<Implausible>,
}

/// A residual whose mean is a sum yet.
#[derive(Default)]
pub(super) struct Sum {
    pub(super) residual: Residual,
    /// The number of readings that count, and the sum and the least of each channel, sr^-1.
    pub(super) read: u16,
    pub(super) channels: [f32; 3],
    pub(super) least: [f32; 3],
}

impl Sum {
    /// Counts a reading that the fit left out, being saturated.
    pub(super) fn left_out(&mut self, status: Status) {
        let saturated = &mut self.residual.saturated;
        *saturated = saturated.saturating_add(u16::from(status.is_saturated()));
    }

    /// Adds a reading and what the fit makes of it, the BRDF in sr^-1, not times the cosine.
    #[inline(never)] // there once, and not for each model
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
        // Logarithms by micromath make numbers of what is none.
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
        let sums = self.channels.iter_mut().zip(&mut self.least);
        for ((sum, least), value) in sums.zip(sample.measured) {
            *sum += value;
            if is_first || value < *least {
                *least = value;
            }
        }
    }
}
