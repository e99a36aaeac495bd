//! Simulated materials, and faults of the color sensor.

use std::array;
use std::f32::consts::FRAC_1_PI;

use glimpse_core::geometry::Directions;

/// Counts without light.
pub(crate) const DARK: f32 = 100.0;

/// A material's BRDF in linear RGB, sr^-1, not times the cosine.
pub type Brdf = Box<dyn Fn(&Directions<f32>) -> [f32; 3]>;

/// A Lambertian base of an albedo, and a GGX highlight of a reflectance at normal incidence and a roughness alpha.
pub type Ggx = ([f32; 3], [f32; 3], f32);

/// A plastic.
pub const PLASTIC: Ggx = ([0.4, 0.25, 0.12], [0.04; 3], 0.35);
/// A metal with a narrow highlight.
pub const METAL: Ggx = ([0.0; 3], [0.9, 0.7, 0.4], 0.2);
/// A black lacquer.
pub const BLACK: Ggx = ([0.02; 3], [0.04; 3], 0.4);

/// Returns the BRDF of a material.
pub fn ggx((albedo, f0, alpha): Ggx) -> Brdf {
    Box::new(move |at| {
        let (i, o) = (at.incoming, at.outgoing);
        let sum: [f32; 3] = array::from_fn(|k| i[k] + o[k]);
        let length = sum.iter().map(|x| x * x).sum::<f32>().sqrt();
        let (cos_h, cos_d, a2) = (sum[2] / length, length / 2.0, alpha * alpha);
        let d = a2 * FRAC_1_PI / (cos_h * cos_h * (a2 - 1.0) + 1.0).powi(2);
        let lambda = |c: f32| (a2 + (1.0 - a2) * c * c).sqrt();
        let visibility = 0.5 / (o[2] * lambda(i[2]) + i[2] * lambda(o[2]));
        array::from_fn(|c| {
            let f = f0[c] + (1.0 - f0[c]) * (1.0 - cos_d).powi(5);
            albedo[c] * FRAC_1_PI + d * visibility * f
        })
    })
}

/// Returns the BRDF of the white tile.
pub fn tile() -> Brdf {
    Box::new(|_| [0.99 * FRAC_1_PI; 3])
}

/// A fault of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorFault {
    /// It does not answer.
    Absent,
    /// It loses its power in each reading.
    PowerLoss,
    /// Its counts do not change.
    Stuck,
}
