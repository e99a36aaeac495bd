//! The built-in environment: an open-air studio.
//!
//! Every edge is a Gaussian or a logistic curve several degrees wide, so that a few thousand directions suffice to
//! integrate it for any BRDF without banding. Every light is wide enough that its reflection on a glossy sphere shows
//! the softening of edges by gloss.

use std::sync::LazyLock;

use super::environment::{Environment, lerp};

/// The radiance of the sky straight above, and at the horizon.
const ZENITH: [f32; 3] = [0.13, 0.22, 0.42];
const HORIZON: [f32; 3] = [0.48, 0.52, 0.58];
/// The radiance of the ground at the horizon, and straight below.
const GROUND: [f32; 3] = [0.26, 0.22, 0.18];
const NADIR: [f32; 3] = [0.10, 0.085, 0.07];

/// A light with a Gaussian profile.
struct GaussianLight {
    /// Direction towards its center, of any length.
    towards: [f32; 3],
    /// Standard deviation in degrees.
    deviation: f32,
    /// Radiance at the center.
    radiance: [f32; 3],
}

/// An upright rectangular light with soft edges.
struct Panel {
    /// Direction towards its center, of any length.
    towards: [f32; 3],
    /// Half the width and half the height, in degrees.
    half_size: [f32; 2],
    radiance: [f32; 3],
}

/// The sun: 8 degrees wide at half its peak. A surface that faces it receives an irradiance of 2.8 (green).
const SUN: GaussianLight = GaussianLight {
    towards: [-0.55, 0.62, 0.56],
    deviation: 3.5,
    radiance: [130.0, 118.0, 100.0],
};
/// A window at the right, a strip behind at the left that lights the rim, and a low reflector in front.
const PANELS: [Panel; 3] = [
    Panel {
        towards: [0.80, 0.25, 0.55],
        half_size: [11.0, 26.0],
        radiance: [2.6, 2.8, 3.2],
    },
    Panel {
        towards: [-0.80, 0.15, -0.58],
        half_size: [7.0, 40.0],
        radiance: [4.5, 4.0, 3.4],
    },
    Panel {
        towards: [0.10, -0.75, 0.65],
        half_size: [30.0, 10.0],
        radiance: [0.55, 0.5, 0.45],
    },
];
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
    let sky = lerp(ZENITH, HORIZON, (-3.5 * up.max(0.0)).exp());
    let ground = lerp(NADIR, GROUND, (-2.5 * (-up).max(0.0)).exp());
    let mut radiance = lerp(ground, sky, logistic(up / 0.03));
    add(&mut radiance, SUN.radiance, SUN.weight(direction));
    for panel in &PANELS {
        add(&mut radiance, panel.radiance, panel.weight(direction));
    }
    radiance
}

impl GaussianLight {
    /// Returns the Gaussian weight of a direction, 1 at the center.
    fn weight(&self, direction: [f32; 3]) -> f32 {
        let deviation = self.deviation.to_radians();
        ((dot(direction, normalized(self.towards)) - 1.0) / (deviation * deviation)).exp()
    }
}

impl Panel {
    /// Returns the weight of a direction: 1 inside, 0 outside.
    fn weight(&self, direction: [f32; 3]) -> f32 {
        let [x, y, z] = normalized(self.towards);
        let horizontal = x.hypot(z);
        let (right, up) = (
            [z / horizontal, 0.0, -x / horizontal],
            [-y * x / horizontal, horizontal, -y * z / horizontal],
        );
        let azimuth = dot(direction, right)
            .atan2(dot(direction, [x, y, z]))
            .to_degrees();
        let elevation = dot(direction, up).clamp(-1.0, 1.0).asin().to_degrees();
        let [half_width, half_height] = self.half_size;
        logistic((half_width - azimuth.abs()) / EDGE)
            * logistic((half_height - elevation.abs()) / EDGE)
    }
}

/// The logistic function: 0 at minus infinity, 1 at infinity.
fn logistic(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

fn add(sum: &mut [f32; 3], radiance: [f32; 3], weight: f32) {
    for (sum, radiance) in sum.iter_mut().zip(radiance) {
        *sum += weight * radiance;
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn normalized(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    a.map(|component| component / length)
}
