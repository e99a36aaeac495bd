//! Checks that readings come from a material.

use super::residual::{Residual, ResidualSum};
use crate::error::ErrorCode;
use crate::geometry::HalfDifference;
use crate::numeric::math::sin_cos;

// With the 33 bundled recipes, the limits refuse 9 of 2,079 scans of 63 materials. "Observed" values below are those of
// recipes without corrections, with 197 materials (80 of MERL as networks, 17 of RGL, 100 procedural).

/// A channel is dead if its mean is below this fraction of the brightest channel's. (Smallest observed fraction: 0.02.)
const DEAD_FRACTION: f32 = 0.001;
/// A residual is implausible if it exceeds [`MIN_RESIDUAL`] and this multiple of the expected loss. (Largest observed
/// multiple: 51.)
const RESIDUAL_FACTOR: f32 = 60.0;
/// The smallest residual that can be implausible.
const MIN_RESIDUAL: f32 = 0.25;
/// The largest plausible albedo at normal incidence. (Largest observed: 1.3.)
const MAX_ALBEDO: f32 = 2.0;
/// The largest plausible minimum of a channel's readings, sr^-1. A white of this BRDF would reflect twice the light
/// that it receives. (Largest observed: 0.31.)
const MAX_MINIMUM: f32 = 2.0 * core::f32::consts::FRAC_1_PI;
/// The smallest number of readings that can show a broken sensor.
const MIN_SAMPLES: u16 = 4;
/// Number of BRDF evaluations for an albedo.
pub(super) const NODES: u16 = 16;

/// Checks the readings of a fit, its albedo at normal incidence, and its residual, if the recipe states or predicts an
/// expected loss.
#[inline(never)]
pub(super) fn check(
    sum: &ResidualSum,
    expected_loss: Option<f32>,
    Albedo(albedo): Albedo,
) -> Option<ErrorCode> {
    let Residual {
        mean,
        repeated,
        clamped,
        ..
    } = sum.residual;
    let has_enough_samples = sum.read >= MIN_SAMPLES;
    let brightest = sum.channels.into_iter().fold(0.0, f32::max);
    if has_enough_samples && (clamped >= sum.read || brightest <= 0.0) {
        return Some(ErrorCode::Dark);
    }
    if has_enough_samples && repeated.saturating_add(1) >= sum.read {
        return Some(ErrorCode::Repeated);
    }
    let codes = [
        ErrorCode::DeadRed,
        ErrorCode::DeadGreen,
        ErrorCode::DeadBlue,
    ];
    let dead = codes
        .into_iter()
        .zip(sum.channels)
        .find(|(_, channel)| *channel < DEAD_FRACTION * brightest);
    if let (true, Some((code, _))) = (has_enough_samples, dead) {
        return Some(code);
    }
    let too_bright = albedo.into_iter().zip(sum.minima).any(|(albedo, minimum)| {
        albedo > MAX_ALBEDO || (has_enough_samples && minimum > MAX_MINIMUM)
    });
    if too_bright {
        return Some(ErrorCode::Albedo);
    }
    let limit = expected_loss.map(|expected| MIN_RESIDUAL.max(RESIDUAL_FACTOR * expected));
    limit
        .is_some_and(|limit| mean > limit)
        .then_some(ErrorCode::Residual)
}

/// The albedo at normal incidence per channel, by the midpoint rule over theta_o.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Albedo([f32; 3]);

impl Albedo {
    /// Adds a node of the rule. `brdf` returns the BRDF in sr^-1, not times the cosine. A node whose BRDF is unknown adds
    /// nothing.
    pub(super) fn add(
        &mut self,
        node: u16,
        brdf: impl FnOnce(&HalfDifference<f32>) -> Option<[f32; 3]>,
    ) {
        // theta_h = pi/4 t^2: denser towards the highlight.
        let t = (f32::from(node) + 0.5) / f32::from(NODES);
        let theta_h = core::f32::consts::FRAC_PI_4 * t * t;
        let (hx, hz) = sin_cos(theta_h);
        let at = HalfDifference {
            hx,
            hz,
            dx: -hx, // the light is at the normal
            dy: 0.0,
            dz: hz,
        };
        let (sine, cosine) = (2.0 * hx * hz, hz * hz - hx * hx);
        // 2 pi sin cos d(theta_o), with theta_o = 2 theta_h.
        let weight = core::f32::consts::PI * core::f32::consts::PI * 2.0 * t / f32::from(NODES);
        for (sum, f) in self.0.iter_mut().zip(brdf(&at).unwrap_or_default()) {
            *sum += f * sine * cosine * weight;
        }
    }
}
