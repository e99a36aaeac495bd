//! A simulated material and board for the examples.

#![allow(dead_code)] // no example uses all items

use std::f32::consts::FRAC_1_PI;

use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Reading;

/// Returns the BRDF of a synthetic red lacquer: linear RGB, sr^-1, not times the cosine.
pub(crate) fn material(directions: &Directions<f32>) -> [f32; 3] {
    let Directions { incoming, outgoing } = *directions;
    let sum: [f32; 3] = std::array::from_fn(|k| incoming[k] + outgoing[k]);
    let length = sum.iter().map(|h| h * h).sum::<f32>().sqrt();
    let (cos_h, cos_d) = (sum[2] / length, length / 2.0); // of theta_h and theta_d
    let (cos_i, cos_o) = (incoming[2], outgoing[2]);
    // A microfacet highlight: GGX with alpha = 0.25, Schlick's Fresnel term, Hammon's shadowing.
    let distribution = FRAC_1_PI * 0.0625 / (1.0 - 0.9375 * cos_h * cos_h).powi(2);
    let fresnel = 0.05 + 0.3 * (1.0 - cos_d).powi(5);
    let visibility = 0.5 / (1.5 * cos_i * cos_o + 0.25 * (cos_i + cos_o));
    let highlight = distribution * fresnel * visibility;
    [0.5, 0.2, 0.1].map(|albedo| albedo * FRAC_1_PI + highlight)
}

/// Returns directions in one plane, with light and sensor on opposite sides of the normal. Angles are in degrees from
/// the normal.
pub(crate) fn in_plane(theta_i: f32, theta_o: f32) -> Directions<f32> {
    let (sin_i, cos_i) = theta_i.to_radians().sin_cos();
    let (sin_o, cos_o) = theta_o.to_radians().sin_cos();
    Directions {
        incoming: [sin_i, 0.0, cos_i],
        outgoing: [-sin_o, 0.0, cos_o],
    }
}

/// Returns theta_i, theta_o and the difference of the azimuths, in degrees.
pub(crate) fn angles(directions: &Directions<f32>) -> [f32; 3] {
    let ([ix, iy, iz], [ox, oy, oz]) = (directions.incoming, directions.outgoing);
    let phi = (ix * oy - iy * ox).atan2(ix * ox + iy * oy);
    [iz.acos(), oz.acos(), phi].map(f32::to_degrees)
}

/// Returns the red channel of the material, as read by a sensor with one channel. The sensor cannot read sample 11.
pub(crate) fn monochrome(index: u16, directions: &Directions<f32>) -> Option<f32> {
    (index != 11).then(|| material(directions)[0])
}

/// A simulated board with motors, a sensor and a clock.
#[derive(Default)]
pub(crate) struct Board {
    pub(crate) now_ms: u64,
    pub(crate) readings: u32,
    /// theta_i, theta_o and phi, in degrees.
    arms: [f32; 3],
}

impl Board {
    /// Moves the arms at 20 degrees per second and reads the sensor.
    pub(crate) fn read(&mut self, directions: &Directions<f32>) -> Reading {
        let target = angles(directions);
        let turns = self.arms.iter().zip(&target).map(|(a, b)| (a - b).abs());
        self.now_ms += (50.0 * turns.fold(0.0, f32::max)) as u64;
        self.arms = target;
        self.readings += 1;
        Reading::new(material(directions))
    }

    /// Sleeps until the next poll of the driver.
    pub(crate) fn sleep(&mut self, delay_ms: Option<u32>) {
        self.now_ms += u64::from(delay_ms.unwrap_or(1));
    }
}
