//! The pair of directions of a point of the unit square, and the BRDF there.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::HalfDifference;

use crate::color::product;
use crate::{Brdf, LUMINANCE, NotFinite};
use glimpse_kernels::dual::RealScalar;

/// The two cosines of theta_o from which the BRDF times cosine is extrapolated below the horizon.
const NEAR_HORIZON: [f64; 2] = [1e-4, 0.02];

/// Returns theta in radians at a coordinate u of the unit square. It is the inverse of u(theta).
pub(super) fn theta(u: f64) -> f64 {
    FRAC_PI_2 * u * u
}

/// Maps an angle theta in \[0, pi/2\] to u(theta) in \[0, 1\].
#[inline(always)]
pub(super) fn unit_theta<S: RealScalar>(theta: S) -> S {
    (theta.relu() * S::constant(2.0 / PI)).sqrt()
}

/// Returns the coordinate in \[0, 1\] of column or row `index` of `count`.
pub(super) fn coordinate(index: usize, count: usize) -> f64 {
    index as f64 / (count - 1) as f64
}

/// Returns the solid angle of normals per area of the unit square.
pub(super) fn solid_angle([u, _]: [f64; 2]) -> f64 {
    2.0 * PI * PI * u * theta(u).sin()
}

/// The directions of a point of the unit square.
pub(super) struct SamplePoint {
    /// Above the horizon, the pair of directions itself, twice. Below, the pairs whose outgoing direction is raised to
    /// each cosine of [`NEAR_HORIZON`].
    directions: [HalfDifference<f32>; 2],
    /// cos(theta_o).
    pub(super) cos_o: f64,
    /// The cosine between the incoming direction and the half vector.
    pub(super) cos_d: f64,
}

impl SamplePoint {
    pub(super) fn new(theta_i: f64, [u, v]: [f64; 2]) -> Self {
        let (sin_i, cos_i) = theta_i.sin_cos();
        let (sin_m, cos_m) = theta(u).sin_cos();
        let (sin_phi, cos_phi) = (PI * (2.0 * v - 1.0)).sin_cos();
        let incoming = [sin_i, 0.0, cos_i];
        let half = [sin_m * cos_phi, sin_m * sin_phi, cos_m];
        let cos_d = sin_i * half[0] + cos_i * half[2];
        let outgoing: [f64; 3] = std::array::from_fn(|i| 2.0 * cos_d * half[i] - incoming[i]);
        let cos_o = outgoing[2];
        let directions = if cos_o >= NEAR_HORIZON[0] {
            [half_difference(incoming, [sin_m, cos_m], [cos_phi, sin_phi]); 2]
        } else {
            NEAR_HORIZON.map(|cosine| raise_outgoing(incoming, outgoing, cosine))
        };
        Self {
            directions,
            cos_o,
            cos_d,
        }
    }
}

/// Returns a pair of directions after raising the outgoing one, at its azimuth, to a given cosine of theta_o.
fn raise_outgoing(incoming: [f64; 3], [x, y, _]: [f64; 3], cosine: f64) -> HalfDifference<f32> {
    let sine = (1.0 - cosine * cosine).sqrt();
    let [x, y] = unit(x, y).map(|along| along * sine);
    let [x, y, z] = [x + incoming[0], y, cosine + incoming[2]];
    let across = x.hypot(y);
    half_difference(incoming, unit(across, z), unit(x, y))
}

/// Normalizes a vector of the plane. Returns (1, 0) if its length is 0.
fn unit(x: f64, y: f64) -> [f64; 2] {
    let length = x.hypot(y);
    if length > 0.0 {
        [x / length, y / length]
    } else {
        [1.0, 0.0]
    }
}

/// Returns half and difference vectors of an incoming direction with azimuth 0. The half vector has a theta with sine
/// `sin_h` and cosine `cos_h`, and an azimuth with cosine `cos_phi` and sine `sin_phi`.
fn half_difference(
    [x, _, z]: [f64; 3],
    [sin_h, cos_h]: [f64; 2],
    [cos_phi, sin_phi]: [f64; 2],
) -> HalfDifference<f32> {
    let (along, across) = (x * cos_phi, -x * sin_phi);
    HalfDifference {
        hx: sin_h as f32,
        hz: cos_h as f32,
        dx: (along * cos_h - z * sin_h) as f32,
        dy: across as f32,
        dz: (along * sin_h + z * cos_h) as f32,
    }
}

/// Returns the BRDF times cos(theta_o) at each point, at least 0. Below the horizon it is extrapolated.
pub(super) fn times_cosine(
    brdf: &dyn Brdf,
    points: &[SamplePoint],
) -> Result<Vec<[f64; 3]>, NotFinite> {
    let [first, second] = [0, 1].map(|index| {
        let directions = points.iter().map(|point| point.directions[index]);
        let directions: Vec<HalfDifference<f32>> = directions.collect();
        brdf.written_values_at(&directions)
    });
    let [low, high] = NEAR_HORIZON;
    let samples = first?.into_iter().zip(second?).zip(points);
    let values = samples.map(|((first, second), point)| {
        std::array::from_fn(|channel| {
            let [first, second] = [first[channel], second[channel]].map(f64::from);
            if point.cos_o >= low {
                return first * point.cos_o;
            }
            let slope = (second * high - first * low) / (high - low);
            (first * low + slope * (point.cos_o - low)).max(0.0)
        })
    });
    Ok(values.collect())
}

pub(super) fn luminance(rgb: [f64; 3]) -> f64 {
    let [luminance] = product(&[LUMINANCE], rgb);
    luminance
}
