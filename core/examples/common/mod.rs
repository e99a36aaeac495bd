//! What the examples scan.

#![allow(dead_code)] // each example takes what it needs

use std::f32::consts::FRAC_1_PI;

use glimpse_core::geometry::Directions;

/// A made-up material, a red lacquer. Linear RGB, sr^-1, not times the cosine.
pub(crate) fn material(directions: &Directions<f32>) -> [f32; 3] {
    let Directions { incoming, outgoing } = *directions;
    let sum: [f32; 3] = std::array::from_fn(|k| incoming[k] + outgoing[k]);
    let length = sum.iter().map(|h| h * h).sum::<f32>().sqrt();
    let (cos_h, cos_d) = (sum[2] / length, length / 2.0); // of theta_h and theta_d
    let (cos_i, cos_o) = (incoming[2], outgoing[2]);
    // A highlight of microfacets: GGX of alpha = 0.25, Schlick's Fresnel term, Hammon's shadowing.
    let distribution = FRAC_1_PI * 0.0625 / (1.0 - 0.9375 * cos_h * cos_h).powi(2);
    let fresnel = 0.05 + 0.3 * (1.0 - cos_d).powi(5);
    let visibility = 0.5 / (1.5 * cos_i * cos_o + 0.25 * (cos_i + cos_o));
    let highlight = distribution * fresnel * visibility;
    [0.5, 0.2, 0.1].map(|albedo| albedo * FRAC_1_PI + highlight)
}

/// Light and sensor in one plane, so many degrees from the normal to either side of it.
pub(crate) fn in_plane(theta_i: f32, theta_o: f32) -> Directions<f32> {
    let (sin_i, cos_i) = theta_i.to_radians().sin_cos();
    let (sin_o, cos_o) = theta_o.to_radians().sin_cos();
    Directions {
        incoming: [sin_i, 0.0, cos_i],
        outgoing: [-sin_o, 0.0, cos_o],
    }
}

/// theta_i, theta_o and the angle between both azimuths, in degrees.
pub(crate) fn angles(directions: &Directions<f32>) -> [f32; 3] {
    let ([ix, iy, iz], [ox, oy, oz]) = (directions.incoming, directions.outgoing);
    let phi = (ix * oy - iy * ox).atan2(ix * ox + iy * oy);
    [iz.acos(), oz.acos(), phi].map(f32::to_degrees)
}
