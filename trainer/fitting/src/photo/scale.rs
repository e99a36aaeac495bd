//! The scale of a photograph's pixels.

use std::f64::consts::PI;

use clap::ValueEnum;

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
