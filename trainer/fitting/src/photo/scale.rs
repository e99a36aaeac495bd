//! The scale of a photograph's pixels.

use std::f64::consts::PI;

use clap::ValueEnum;
use glimpse_materials::lists::add_scaled;

use super::Photograph;
use super::ball::{Ball, dot};
use super::picture::LinearPicture;

/// The shape of a white reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhiteShape {
    /// A ball in the place of the ball, also of another size.
    Ball,
    /// A flat tile in the place of the ball, facing the camera.
    Tile,
}

impl LinearPicture {
    /// Marks pixels of a saturated sensor, from a share of full scale on, as infinite. Without a level it is 0.99 of full scale,
    /// or none if pixels are above 1, as in a picture of several exposures.
    pub fn mark_saturated(&mut self, level: Option<f32>) {
        let values = self.pixels.as_flattened_mut();
        let is_of_several = values.iter().any(|value| *value > 1.0);
        let level = level.unwrap_or(if is_of_several { f32::INFINITY } else { 0.99 });
        for value in values.iter_mut().filter(|value| **value >= level) {
            *value = f32::INFINITY;
        }
    }

    /// Subtracts a picture of the same size, taken without the lamp: the black level and the light of the room.
    pub fn subtract(&mut self, dark: &Self) {
        let values = self.pixels.as_flattened_mut().iter_mut();
        for (value, dark) in values.zip(dark.pixels.as_flattened()) {
            *value -= dark;
        }
    }

    /// Makes pixels unknown where a mask of the same size is below 1.
    pub fn mask(&mut self, mask: &Self) {
        let pairs = self.pixels.iter_mut().zip(&mask.pixels);
        for (pixel, _) in pairs.filter(|(_, mask)| mask[0] < 1.0) {
            *pixel = [f32::NAN; 3];
        }
    }

    /// Returns the width of the blocks of pixels that make the longer side of a picture at most `side`.
    #[must_use]
    pub fn block([width, height]: [usize; 2], side: usize) -> usize {
        width.max(height).div_ceil(side).max(1)
    }

    /// Returns the means over [blocks](Self::block) of pixels.
    #[must_use]
    pub fn shrunk(self, side: usize) -> Self {
        let block = Self::block([self.width, self.height], side);
        let (width, height) = (self.width / block, self.height / block);
        let mean = |index: usize| {
            let first = index / width * block * self.width + index % width * block;
            let rows = (0..block).map(|row| &self.pixels[first + row * self.width..][..block]);
            let mut sum = [0.0; 3];
            rows.flatten()
                .for_each(|pixel| add_scaled(&mut sum, 1.0, pixel));
            sum.map(|channel| channel / (block * block) as f32)
        };
        Self {
            width,
            height,
            pixels: (0..width * height).map(mean).collect(),
        }
    }

    /// Returns the pixel between pixels, NaN off the picture.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let is_inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 - 1.0;
        let (right, down) = (x.fract(), y.fract());
        let weights = [1.0 - down, down].map(|weight| [weight * (1.0 - right), weight * right]);
        let mut sum = [0.0; 3];
        for (corner, weight) in weights.as_flattened().iter().enumerate() {
            let index = (y as usize + corner / 2) * self.width + x as usize + corner % 2;
            let pixel = self.pixels.get(index).filter(|_| is_inside);
            let pixel = pixel.map_or([f64::NAN; 3], |pixel| pixel.map(f64::from));
            add_scaled(&mut sum, *weight, &pixel);
        }
        sum
    }
}

impl Photograph {
    /// Divides each pixel by that of a white reference in the same light and of the same exposure, whose BRDF is reflectance / pi:
    /// by the pixel of the same normal on a white ball, by that at the same place on a tile. So the light's intensity and the
    /// vignetting cancel, too. Pixels are NaN where the white is unknown or saturated.
    pub fn divide_by_white(
        &mut self,
        white: &LinearPicture,
        ball: Option<&Ball>,
        reflectance: [f32; 3],
    ) {
        let (own, light) = (self.ball, self.light.direction);
        for index in 0..self.picture.pixels.len() {
            let at = self.picture.place(index);
            let (place, cosine) = match ball {
                None => (at, light[2]),
                Some(ball) => {
                    let scale = ball.radius / own.radius;
                    let place = [0, 1].map(|axis: usize| {
                        ball.center[axis] + (at[axis] - own.center[axis]) * scale
                    });
                    let view = own.view(at);
                    (place, view.map_or(f64::NAN, |view| dot(view.normal, light)))
                }
            };
            let white = white.at(place);
            for (channel, value) in self.picture.pixels[index].iter_mut().enumerate() {
                let light = white[channel] / (f64::from(reflectance[channel]) / PI * cosine);
                let known = Some(light).filter(|light| *light > 0.0 && light.is_finite());
                *value /= known.map_or(f32::NAN, |light| light as f32);
            }
        }
        self.light.intensity = None;
    }
}

/// Multiplies the lights' intensities, or 1, so that the median of pi f over all used pixels and channels is an albedo.
pub fn set_albedo(photographs: &mut [Photograph], albedo: f64) {
    let mut reflectances = Vec::new();
    for photograph in &*photographs {
        let pixels = photograph.pixels(0, &photograph.uses()).into_iter();
        reflectances.extend(pixels.map(|pixel| PI * pixel.brdf.iter().sum::<f64>() / 3.0));
    }
    reflectances.sort_by(f64::total_cmp);
    // Without used pixels, no scale is needed.
    let median = reflectances.get(reflectances.len() / 2).copied();
    let scale = median.unwrap_or(albedo).max(1e-9) / albedo;
    for photograph in photographs {
        let intensity = photograph.light.intensity.unwrap_or([1.0; 3]);
        photograph.light.intensity = Some(intensity.map(|channel| scale * channel));
    }
}
