//! Light on a sphere, and in the plane of incidence.

use core::f32::consts::{FRAC_PI_2, PI};
use core::ops::Range;

use glimpse_core::geometry::{Directions, Spherical};

use crate::scene::Scene;

/// The distance from a sphere's center, in radii, beyond which pixels are as those nearer to it: at
/// the very rim the surface is seen edge on, where a BRDF means nothing.
const RIM: f32 = 0.9995;

/// Shades rows of a sphere; returns how many pixels these are.
pub(crate) fn sphere(scene: &mut Scene, size: u32, rows: Range<u32>, light: [f32; 3]) -> u32 {
    let rows = rows.start..rows.end.min(size);
    let count = rows.len() as u32 * size;
    let is_done = scene.draw(3 * count as usize, |shown, pixels| {
        let places = rows.flat_map(|row| (0..size).map(move |column| (column, row)));
        for (pixel, (column, row)) in pixels.iter_mut().zip(places) {
            let place = |index: u32| (2 * index + 1) as f32 / size as f32 - 1.0;
            let normal = normal(place(column), -place(row));
            let [x, y, z] = normal;
            // The sensor is along z, so its coordinates in a frame about the normal are those of z.
            let [incoming, outgoing] = [light, [0.0, 0.0, 1.0]].map(|to| {
                // Duff et al. 2017, where z is never negative.
                let a = -1.0 / (1.0 + z);
                let b = x * y * a;
                let tangent = [1.0 + x * x * a, b, -x];
                let other = [b, 1.0 + y * y * a, -y];
                [dot(to, tangent), dot(to, other), dot(to, normal)]
            });
            let cosine = incoming[2];
            *pixel = if cosine > 0.0 {
                let brdf = shown.brdf(&Directions { incoming, outgoing });
                brdf.map(|f| PI * f * cosine)
            } else {
                [0.0; 3]
            };
        }
    });
    if is_done { count } else { 0 }
}

/// The normal of a sphere of radius 1 as seen along -z.
fn normal(x: f32, y: f32) -> [f32; 3] {
    let distance = libm::sqrtf(x * x + y * y);
    let scale = if distance > RIM { RIM / distance } else { 1.0 };
    let [x, y] = [x * scale, y * scale];
    [x, y, libm::sqrtf(1.0 - x * x - y * y)]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The BRDF in the plane of incidence; returns how many angles there are.
pub(crate) fn lobe(scene: &mut Scene, theta_i: f32, steps: u32) -> u32 {
    let towards = |theta: f32| Spherical { theta, phi: 0.0 }.direction();
    let incoming = towards(-theta_i);
    let is_done = scene.draw(3 * steps as usize, |shown, values| {
        for (step, value) in values.iter_mut().enumerate() {
            let theta_o = (2 * step + 1) as f32 / steps as f32 * FRAC_PI_2 - FRAC_PI_2;
            let outgoing = towards(theta_o);
            *value = shown.brdf(&Directions { incoming, outgoing });
        }
    });
    if is_done { steps } else { 0 }
}
