//! The residual of a fit.

use serde::{Deserialize, Serialize};

use super::evidence::{Evidence, EvidenceLimits};
use super::slot::{Status, is_clamped, measured_brdf};
use crate::error::ErrorCode;
use crate::geometry::HalfDifference;
use crate::model::loss::cosine_weighted_log_error;
use crate::model::{Sample, Slot, unpack};

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
    /// Number of readings that were too far below 0 for the loss. The fit clamps them.
    pub clamped: u16,
    /// The reason why the fitted material is implausible, if it is: [`ErrorCode::Dark`] to
    /// [`ErrorCode::Restored`], or a reason that this version does not know.
    pub implausible: Option<ErrorCode>,
    /// The checks of a [`Driver`](crate::driver::Driver). They are empty without one.
    pub evidence: Evidence,
}

impl Residual {
    /// Adds the evidence of a scan with this number of readings. A cause that it names precedes the effect on the fit.
    pub(crate) fn with_evidence(
        self,
        evidence: Evidence,
        limits: EvidenceLimits,
        recorded: u16,
    ) -> Self {
        let exceeds = |value: f32, limit: f32| limit > 0.0 && (value > limit || value.is_nan());
        let saturated = f32::from(self.saturated) / f32::from(recorded.max(1));
        let causes = [
            (ErrorCode::RoomLight, evidence.dark, limits.dark),
            (ErrorCode::Drift, evidence.drift, limits.drift),
            (ErrorCode::Saturated, Some(saturated), limits.saturated),
        ];
        let mut causes = causes.into_iter();
        let cause = causes.find_map(|(code, value, limit)| exceeds(value?, limit).then_some(code));
        let is_old = evidence.restored >= recorded;
        let restored = is_old.then_some(ErrorCode::Restored);
        Self {
            implausible: cause.or(self.implausible).or(restored),
            evidence,
            ..self
        }
    }
}

/// A residual that is being computed: its mean is still a sum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ResidualSum {
    pub(super) residual: Residual,
    /// Number of added readings, without the omitted ones.
    pub(super) read: u16,
    /// The sum of each channel, sr^-1.
    pub(super) channels: [f32; 3],
    /// The minimum of each channel, sr^-1.
    pub(super) minima: [f32; 3],
    /// The bits of the previous reading in the pattern.
    previous: Option<[u32; 3]>,
}

impl ResidualSum {
    /// Adds the reading of a sample. `modeled` returns the fit's BRDF for it in sr^-1, not times the cosine.
    #[inline(never)] // compiled once, not once per model
    pub(super) fn add(
        &mut self,
        index: u16,
        slot: &Slot,
        modeled: impl FnOnce(&HalfDifference<f32>) -> [f32; 3],
    ) {
        let status = Status::of(slot);
        if !status.has(Status::READ) {
            return;
        }
        let bits = measured_brdf(slot).map(f32::to_bits);
        let is_repeated = self.previous.replace(bits) == Some(bits);
        let count = |sum: u16, flag: bool| sum.saturating_add(u16::from(flag));
        let residual = &mut self.residual;
        residual.saturated = count(residual.saturated, status.has(Status::SATURATED));
        if !status.has(Status::COUNTED) {
            return;
        }
        let Sample { at, measured, .. } = unpack(slot, 1.0);
        let modeled = modeled(&at);
        let loss = cosine_weighted_log_error(measured, modeled, at.cos_theta_i(), 1.0 / 3.0);
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
        residual.repeated = count(residual.repeated, is_repeated);
        residual.clamped = count(residual.clamped, is_clamped(slot));
        let is_first = self.read == 0;
        self.read = self.read.saturating_add(1);
        let sums = self.channels.iter_mut().zip(&mut self.minima);
        for ((sum, minimum), value) in sums.zip(measured) {
            *sum += value;
            if is_first || value < *minimum {
                *minimum = value;
            }
        }
    }
}
