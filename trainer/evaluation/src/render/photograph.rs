//! Photographs of a ball under a distant light.

use glimpse_core::geometry::HalfDifference;
use glimpse_fitting::photo::{Ball, Light};
use glimpse_materials::Brdf;
use rayon::prelude::*;

use super::Image;
use super::sphere::DIAMETER;

/// Returns the ball of a photograph of size x size pixels from far away, which is as large as the sphere of
/// [`render_sphere`](super::render_sphere).
#[must_use]
pub fn distant_ball(size: usize) -> Ball {
    let middle = 0.5 * (size as f64 - 1.0);
    Ball::distant([middle, middle, 0.5 * f64::from(DIAMETER) * size as f64])
}

/// Photographs a ball of a material: the BRDF times cos(theta_i) and the light's intensity, or 1 if it is unknown, averaged over
/// `subpixels` x `subpixels` positions of each pixel. It is 0 off the ball and where the light does not reach. Interreflections
/// are not rendered.
pub fn photograph(
    brdf: &dyn Brdf,
    ball: &Ball,
    light: &Light,
    [width, height]: [usize; 2],
    subpixels: usize,
) -> Image {
    let mut image = Image::filled(width, height, [0.0; 3]);
    let position = |index: usize| (index as f64 + 0.5) / subpixels as f64 - 0.5;
    let shares = light.intensity.unwrap_or([1.0; 3]);
    let shares = shares.map(|intensity| intensity as f32 / (subpixels * subpixels) as f32);
    let rows = image.pixels.par_chunks_mut(width.max(1)).enumerate();
    rows.for_each(|(row, pixels)| {
        let lit = (0..width * subpixels * subpixels).filter_map(|index| {
            let [x, y] = [index / subpixels, row * subpixels + index % subpixels];
            let angles = ball.view([x, y].map(position))?.angles(light.direction)?;
            Some((x / subpixels, HalfDifference::from_angles(angles)))
        });
        let (columns, at): (Vec<usize>, Vec<HalfDifference<f32>>) = lit.unzip();
        for ((column, at), value) in columns.iter().zip(&at).zip(brdf.values_at(&at)) {
            for (channel, sum) in pixels[*column].iter_mut().enumerate() {
                *sum += shares[channel] * value[channel] * at.cos_theta_i();
            }
        }
    });
    image
}
