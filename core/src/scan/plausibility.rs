//! Signs that readings are not those of a material.

use super::implausible::Implausible;
use super::residual::{Residual, Sum};
use crate::geometry::HalfDifference;
use crate::numeric::math::sin_cos;

// The limits exclude none of 197 materials (80 of MERL as networks, 17 of RGL, 100 procedural) with any of the 33 bundled
// recipes, but RGL's color-shifting `chm_mint` with some of them. `cargo run --release -p glimpse-tests --example
// plausibility -- SOURCE...` prints the extremes.

/// A channel whose mean is below this share of the brightest one's is dead. (The least of other materials: 0.02.)
const DEAD: f32 = 0.001;
/// A residual is implausible if it is more than this multiple of the expected loss (the most of others: 51),
const RESIDUAL_FACTOR: f32 = 60.0;
/// and more than this.
const MIN_RESIDUAL: f32 = 0.25;
/// The largest plausible albedo at normal incidence (the most: 1.3),
const MAX_ALBEDO: f32 = 2.0;
/// and the largest plausible least reading of a channel, sr^-1: such a white would reflect twice the light it receives.
/// (The most: 0.31.)
const MAX_LEAST: f32 = 2.0 * core::f32::consts::FRAC_1_PI;
/// Fewer readings tell nothing about the sensor.
const MIN_SAMPLES: u16 = 4;
/// Evaluations of an albedo.
const NODES: u16 = 16;

/// Judges a fit by its readings, its expected loss if the recipe states or predicts one, and its albedo at normal
/// incidence.
#[inline(never)]
pub(super) fn check(
    sum: &Sum,
    expected_loss: Option<f32>,
    albedo: Option<[f32; 3]>,
) -> Option<Implausible> {
    let Residual {
        mean,
        repeated,
        clamped,
        ..
    } = sum.residual;
    let enough = sum.read >= MIN_SAMPLES;
    let brightest = sum.channels.into_iter().fold(0.0, f32::max);
    if enough && (clamped >= sum.read || brightest <= 0.0) {
        return Some(Implausible::Dark);
    }
    if enough && repeated.saturating_add(1) >= sum.read {
        return Some(Implausible::Repeated);
    }
    let dead = (0..)
        .zip(sum.channels)
        .find(|(_, channel)| *channel < DEAD * brightest);
    if let (true, Some((channel, _))) = (enough, dead) {
        return Some(Implausible::DeadChannel(channel));
    }
    let by_fit = albedo.unwrap_or_default().into_iter();
    let too_bright = by_fit
        .zip(sum.least)
        .any(|(albedo, least)| albedo > MAX_ALBEDO || (enough && least > MAX_LEAST));
    if too_bright {
        return Some(Implausible::Albedo);
    }
    let limit = expected_loss.map(|expected| MIN_RESIDUAL.max(RESIDUAL_FACTOR * expected));
    limit
        .is_some_and(|limit| mean > limit)
        .then_some(Implausible::Residual)
}

/// The share of light from the normal that a material reflects, per channel, by the midpoint rule over theta_o. `brdf`
/// is in sr^-1, not times the cosine. None where the BRDF is unknown.
pub(super) fn albedo(brdf: impl Fn(&HalfDifference<f32>) -> Option<[f32; 3]>) -> Option<[f32; 3]> {
    let mut albedo = [0.0; 3];
    for node in 0..NODES {
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
        for (sum, f) in albedo.iter_mut().zip(brdf(&at)?) {
            *sum += f * sine * cosine * weight;
        }
    }
    Some(albedo)
}
