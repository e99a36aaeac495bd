//! A simulated material and flash for the examples.

#![allow(dead_code, unreachable_pub)] // each example uses a part, and tests another

use std::f32::consts::FRAC_1_PI;

use glimpse_core::geometry::Directions;

pub(crate) mod flash;

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
