//! Renderings of a sphere by direct integration.

use std::array;
use std::collections::BTreeMap;

use glimpse_materials::Brdf;
use rayon::prelude::*;

use super::Image;
use super::environment::Environment;
use super::quadrature::{HalfVectors, Nodes, RINGS};
use super::studio::STUDIO;

/// Radiance of the background.
pub(super) const BACKGROUND: [f32; 3] = [0.08; 3];
/// Ratio of the sphere's diameter to the picture's side.
pub(super) const DIAMETER: f32 = 0.96;

/// Renders a sphere of a material in the built-in studio, with size x size pixels and an orthographic camera.
///
/// The incoming direction points to the light, and the BRDF is isotropic. Every pixel is the integral of
/// f(w_i, w_o) L(w_i) cos(theta_i) over the hemisphere. The quadrature rule is fixed, so that equal BRDFs give equal
/// bits. Pixels at the same distance from the center have the same outgoing angle and share one batched call of `brdf`.
/// Shadows and interreflections are not rendered. Pixels off the sphere have the radiance 0.08.
pub fn render_sphere(brdf: &dyn Brdf, size: usize) -> Image {
    render_in(&STUDIO, brdf, size, RINGS)
}

/// Iterates over the indices of the pixels whose centers lie on the sphere of [`render_sphere`], row by row from the
/// top left. In a picture that is not square, the sphere fits into the shorter side.
pub fn sphere_disc(width: usize, height: usize) -> impl Iterator<Item = usize> {
    let radius = 0.5 * DIAMETER * width.min(height) as f32;
    (0..width * height).filter(move |index| {
        let centered = |position: usize, side: usize| position as f32 + 0.5 - 0.5 * side as f32;
        let x = centered(index % width, width);
        let y = centered(index / width, height);
        x * x + y * y <= radius * radius
    })
}

/// Renders a sphere under an environment, with a quadrature rule of `rings` rings.
pub(super) fn render_in(
    environment: &Environment,
    brdf: &dyn Brdf,
    size: usize,
    rings: usize,
) -> Image {
    let half_vectors = HalfVectors::new(rings);
    let mut image = Image::filled(size, size, BACKGROUND);
    let circles: Vec<Circle> = circles(size);
    let shaded: Vec<(usize, [f32; 3])> = circles
        .par_iter()
        .map_init(Nodes::default, |nodes, circle| {
            shade(nodes, brdf, environment, &half_vectors, circle)
        })
        .flatten_iter()
        .collect();
    for (index, radiance) in shaded {
        if let Some(pixel) = image.pixels.get_mut(index) {
            *pixel = radiance;
        }
    }
    image
}

/// Pixels at one distance from the center of the sphere.
pub(super) struct Circle {
    pub(super) sin_theta_o: f32,
    pub(super) cos_theta_o: f32,
    /// Fraction of each pixel that the sphere covers, in \[0, 1\].
    pub(super) coverage: f32,
    /// Index of each pixel in the image, with the cosine and sine of its azimuth about the center.
    pub(super) pixels: Vec<(usize, [f32; 2])>,
}

/// Groups all pixels on the sphere by their distance from the center.
pub(super) fn circles(size: usize) -> Vec<Circle> {
    let radius = 0.5 * DIAMETER * size as f32;
    // Twice the distance from the center is a whole number along both axes.
    let doubled = |index: usize| 2 * index as i64 + 1 - size as i64;
    let mut pixels_by_distance: BTreeMap<i64, Vec<(usize, [f32; 2])>> = BTreeMap::new();
    for row in 0..size {
        for column in 0..size {
            let (x, y) = (doubled(column), -doubled(row));
            let squared_distance = x * x + y * y;
            let distance = (squared_distance as f32).sqrt();
            let azimuth = if squared_distance > 0 {
                [x as f32 / distance, y as f32 / distance]
            } else {
                [1.0, 0.0]
            };
            pixels_by_distance
                .entry(squared_distance)
                .or_default()
                .push((row * size + column, azimuth));
        }
    }
    let circle = |(squared_distance, pixels)| {
        let distance = 0.5 * (squared_distance as f32).sqrt();
        // Pixels on the rim are shaded at half a pixel inside the rim, where the normal faces the viewer, and blended
        // with the background.
        let sin_theta_o = distance.min(radius - 0.5) / radius;
        Circle {
            sin_theta_o,
            cos_theta_o: (1.0 - sin_theta_o * sin_theta_o).sqrt(),
            coverage: (radius - distance + 0.5).clamp(0.0, 1.0),
            pixels,
        }
    };
    pixels_by_distance
        .into_iter()
        .map(circle)
        .filter(|circle| circle.coverage > 0.0)
        .collect()
}

/// Returns the radiance of each pixel of a circle. `nodes` is a buffer.
fn shade(
    nodes: &mut Nodes,
    brdf: &dyn Brdf,
    environment: &Environment,
    half_vectors: &HalfVectors,
    circle: &Circle,
) -> Vec<(usize, [f32; 3])> {
    half_vectors.nodes(circle.sin_theta_o, circle.cos_theta_o, nodes);
    let values = brdf.values_at(&nodes.at).into_iter();
    let weighted = values.zip(&nodes.weight);
    let weighted: Vec<[f32; 3]> = weighted
        .map(|(value, weight)| value.map(|channel| channel * weight))
        .collect();
    let shade_pixel = |&(index, azimuth): &(usize, [f32; 2])| {
        let mut sum = [0.0; 4];
        for (incoming, [r, g, b]) in nodes.incoming.iter().zip(&weighted) {
            let direction = circle.to_picture_frame(azimuth, *incoming);
            let light = environment.radiance(direction);
            let value = [*r, *g, *b, 0.0];
            sum = array::from_fn(|channel| sum[channel] + light[channel] * value[channel]);
        }
        let [r, g, b, _] = sum;
        let mut radiance = BACKGROUND;
        for (pixel, shaded) in radiance.iter_mut().zip([r, g, b]) {
            *pixel += circle.coverage * (shaded - *pixel);
        }
        (index, radiance)
    };
    circle.pixels.iter().map(shade_pixel).collect()
}

impl Circle {
    /// Transforms a direction from the surface's frame to the picture's frame. The x axis of the surface's frame lies
    /// in the plane of normal and viewer.
    #[inline(always)]
    pub(super) fn to_picture_frame(
        &self,
        [cos_phi, sin_phi]: [f32; 2],
        [x, y, z]: [f32; 3],
    ) -> [f32; 3] {
        // The normal has azimuth phi; x points from the normal towards the viewer.
        let outwards = z * self.sin_theta_o - x * self.cos_theta_o;
        [
            outwards * cos_phi + y * sin_phi,
            outwards * sin_phi - y * cos_phi,
            x * self.sin_theta_o + z * self.cos_theta_o,
        ]
    }
}
