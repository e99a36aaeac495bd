//! Shading of a sphere, and the BRDF in the plane of incidence.

use core::f32::consts::{FRAC_PI_2, PI};
use core::ops::Range;

use glimpse_core::geometry::{Arms, Directions};

use crate::scene::Scene;

/// Maximum distance of shaded points from the sphere's center in the picture, in radii. Pixels beyond it repeat the
/// shading at it. At distance 1, the viewing direction is at the horizon, where a BRDF is undefined.
const RIM: f32 = 0.9995;

/// Shades rows of a sphere and returns the number of pixels.
pub(crate) fn sphere(scene: &mut Scene, size: u32, rows: Range<u32>, light: [f32; 3]) -> u32 {
    let rows = rows.start..rows.end.min(size);
    let count = rows.len() as u32 * size;
    let is_done = scene.with_surface(3 * count as usize, |surface, pixels| {
        let positions = rows.flat_map(|row| (0..size).map(move |column| (column, row)));
        for (pixel, (column, row)) in pixels.iter_mut().zip(positions) {
            let coordinate = |index: u32| (2 * index + 1) as f32 / size as f32 - 1.0;
            let normal = normal(coordinate(column), -coordinate(row));
            let [x, y, z] = normal;
            // The sensor is in direction z.
            let [incoming, outgoing] = [light, [0.0, 0.0, 1.0]].map(|direction| {
                // Orthonormal basis of Duff et al. 2017, for z >= 0.
                let a = -1.0 / (1.0 + z);
                let b = x * y * a;
                let tangent = [1.0 + x * x * a, b, -x];
                let bitangent = [b, 1.0 + y * y * a, -y];
                [tangent, bitangent, normal].map(|axis| dot(direction, axis))
            });
            let cosine = incoming[2];
            *pixel = if cosine > 0.0 {
                let brdf = surface
                    .brdf(&Directions { incoming, outgoing })
                    .unwrap_or_default();
                brdf.map(|f| PI * f * cosine)
            } else {
                [0.0; 3]
            };
        }
    });
    if is_done { count } else { 0 }
}

/// Returns the normal of the unit sphere at position x, y in the picture, which shows the sphere along -z.
fn normal(x: f32, y: f32) -> [f32; 3] {
    let distance = libm::sqrtf(x * x + y * y);
    let scale = if distance > RIM { RIM / distance } else { 1.0 };
    let [x, y] = [x * scale, y * scale];
    [x, y, libm::sqrtf(1.0 - x * x - y * y)]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Evaluates the BRDF in the plane of incidence and returns the number of angles.
pub(crate) fn lobe(scene: &mut Scene, theta_i: f32, steps: u32) -> u32 {
    let is_done = scene.with_surface(3 * steps as usize, |surface, values| {
        for (step, value) in values.iter_mut().enumerate() {
            let theta_o = (2 * step + 1) as f32 / steps as f32 * FRAC_PI_2 - FRAC_PI_2;
            let arms = Arms::from_array([-theta_i, 0.0, theta_o, 0.0]);
            *value = surface.brdf(&arms.directions()).unwrap_or_default();
        }
    });
    if is_done { steps } else { 0 }
}
