//! The built-in environment: an open-air studio.
//!
//! Every edge is a Gaussian or a logistic curve several degrees wide, so that a few thousand directions suffice to
//! integrate it for any BRDF without banding. Every light is wide enough that its reflection on a glossy sphere shows
//! the softening of edges by gloss.

use std::sync::LazyLock;

use glimpse_materials::rows;
use nalgebra::Vector3;
use serde::Deserialize;

use super::environment::{Environment, lerp};

/// The radiance of the sky straight above, and at the horizon.
const ZENITH: [f32; 3] = [0.13, 0.22, 0.42];
const HORIZON: [f32; 3] = [0.48, 0.52, 0.58];
/// The radiance of the ground at the horizon, and straight below.
const GROUND: [f32; 3] = [0.26, 0.22, 0.18];
const NADIR: [f32; 3] = [0.10, 0.085, 0.07];

/// The sun, a light with a Gaussian profile that is 8 degrees wide at half its peak. A surface that faces it receives an
/// irradiance of 2.8 (green). Direction towards its center, of any length; standard deviation in degrees; and radiance at the
/// center.
const SUN: [f32; 3] = [-0.55, 0.62, 0.56];
const SUN_DEVIATION: f32 = 3.5;
const SUN_RADIANCE: [f32; 3] = [130.0, 118.0, 100.0];

/// An upright rectangular light with soft edges.
#[derive(Deserialize)]
struct Panel {
    /// Direction towards its center, of any length.
    towards: [f32; 3],
    /// Half the width and half the height, in degrees.
    half_size: [f32; 2],
    radiance: [f32; 3],
}

/// A window at the right, a strip behind at the left that lights the rim, and a low reflector in front.
static PANELS: LazyLock<Vec<Panel>> = LazyLock::new(|| rows(include_str!("panels.csv")));
/// Softness of a panel's edge: the scale of a logistic curve, degrees.
const EDGE: f32 = 1.3;

/// The built-in environment: blue sky above brown ground, a soft sun over the viewer's left shoulder, a window at the
/// right, a strip of light behind at the left, and a dim reflector below.
///
/// Radiance is 0.1 to 0.6 for sky and ground, 0.5 to 4.5 for the panels, and 100 to 130 at the sun's center. A white
/// diffuse surface that faces the viewer reflects about 0.9.
pub(super) static STUDIO: LazyLock<Environment> = LazyLock::new(|| Environment::from_fn(radiance));

/// Returns the studio's radiance from a unit direction.
fn radiance(direction: [f32; 3]) -> [f32; 3] {
    let [_, up, _] = direction;
    let direction = Vector3::from(direction);
    let sky = lerp(ZENITH, HORIZON, (-3.5 * up.max(0.0)).exp());
    let ground = lerp(NADIR, GROUND, (-2.5 * (-up).max(0.0)).exp());
    let mut radiance = Vector3::from(lerp(ground, sky, logistic(up / 0.03)));
    radiance += sun_weight(direction) * Vector3::from(SUN_RADIANCE);
    for panel in &*PANELS {
        radiance += panel.weight(direction) * Vector3::from(panel.radiance);
    }
    radiance.into()
}

/// Returns the Gaussian weight of a direction, 1 at the center of the sun.
fn sun_weight(direction: Vector3<f32>) -> f32 {
    let deviation = SUN_DEVIATION.to_radians();
    ((direction.dot(&Vector3::from(SUN).normalize()) - 1.0) / (deviation * deviation)).exp()
}

impl Panel {
    /// Returns the weight of a direction: 1 inside, 0 outside.
    fn weight(&self, direction: Vector3<f32>) -> f32 {
        let center = Vector3::from(self.towards).normalize();
        let [x, y, z] = center.into();
        let horizontal = x.hypot(z);
        let right = Vector3::new(z / horizontal, 0.0, -x / horizontal);
        let up = Vector3::new(-y * x / horizontal, horizontal, -y * z / horizontal);
        let azimuth = direction.dot(&right).atan2(direction.dot(&center));
        let elevation = direction.dot(&up).clamp(-1.0, 1.0).asin();
        let [half_width, half_height] = self.half_size;
        logistic((half_width - azimuth.to_degrees().abs()) / EDGE)
            * logistic((half_height - elevation.to_degrees().abs()) / EDGE)
    }
}

/// The logistic function: 0 at minus infinity, 1 at infinity.
fn logistic(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}
