//! Readings chosen among the pixels of photographs.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use clap::ValueEnum;
use glimpse_core::geometry::{Angles, HalfDifference};

use super::Photograph;
use super::ball::dot;

/// The number of readings of all photographs. More improve no fit: errors of neighbors are equal.
const READINGS: usize = 300;
/// The smallest cosines of the light's and the camera's directions: below them, small errors of the circle and light are large
/// ones of the reading.
const MIN_COSINE: f64 = 0.12;
/// The width of the rim, whose pixels show the background, too, in pixels.
const RIM: f64 = 1.5;
/// The relative standard deviation of the errors that neighbors share: of the light's intensity, the surface, and light
/// from the room.
const SHARED_NOISE: f64 = 0.08;
/// The typical error of normals and the light, in radians: a light that is measured by hand, and half a pixel of the circle.
const DIRECTION_ERROR: f64 = 0.026;

/// The smallest distance of an outlier from the median of its neighbors, in logarithms, and in median distances.
const MIN_CONTRAST: f64 = 0.2;
const MAX_SPREADS: f64 = 6.0;
/// The largest noise: where the light changes more from pixel to pixel, a reading says nothing.
const MAX_NOISE: f64 = 0.5;

/// The use of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelUse {
    /// It is a part of a reading.
    Used,
    /// The sensor was saturated.
    Saturated,
    /// The light does not reach it, or below the smallest cosine.
    Shadowed,
    /// The camera sees it below the smallest cosine.
    Grazing,
    /// It is within 1.5 pixels of the outline.
    Rim,
    /// It is unlike its neighbors, such as dust or a reflection of the room.
    Outlier,
    /// The mask or the white picture leaves it out.
    Masked,
}

/// A reading of neighboring pixels, and of their mirror images in the plane of light and camera.
#[derive(Clone, Debug)]
pub struct PhotoReading {
    /// Rusinkiewicz angles in radians.
    pub angles: Angles<f64>,
    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    pub brdf: [f64; 3],
    /// The standard deviation of its noise, relative to the reading.
    pub noise: f64,
    /// The index of the photograph.
    pub photograph: usize,
    /// The index of the pixel that differs most from the mean.
    pub index: usize,
}

/// A used pixel.
pub(super) struct Pixel {
    angles: Angles<f64>,
    pub(super) brdf: [f64; 3],
    /// The logarithm of the mean BRDF of the channels.
    logarithm: f64,
    /// The squared relative change of its light within the error of directions.
    change: f64,
    photograph: usize,
    index: usize,
}

impl Photograph {
    /// Returns what is done with each pixel, row by row; None off the ball.
    #[must_use]
    pub fn uses(&self) -> Vec<Option<PixelUse>> {
        let pixels = self.picture.pixels.iter().enumerate();
        let uses = pixels.map(|(index, pixel)| {
            let [x, y] = self.picture.place(index);
            let view = self.ball.view([x, y])?;
            let [right, down] = [x - self.ball.center[0], y - self.ball.center[1]];
            Some(if right.hypot(down) > self.ball.radius - RIM {
                PixelUse::Rim
            } else if dot(view.normal, view.outgoing) < MIN_COSINE {
                PixelUse::Grazing
            } else if dot(view.normal, self.light.direction) < MIN_COSINE {
                PixelUse::Shadowed
            } else if pixel.iter().any(|channel| channel.is_nan()) {
                PixelUse::Masked
            } else if pixel.contains(&f32::INFINITY) {
                PixelUse::Saturated
            } else {
                PixelUse::Used
            })
        });
        uses.collect()
    }

    /// Returns the BRDF times cos(theta_i) of a pixel, the index of which is valid.
    #[must_use]
    pub fn radiance(&self, index: usize) -> [f64; 3] {
        let intensity = self.light.intensity.unwrap_or([1.0; 3]);
        let pixel = self.picture.pixels[index];
        [0, 1, 2].map(|channel| f64::from(pixel[channel]) / intensity[channel])
    }

    /// Returns the used pixels.
    pub(super) fn pixels(&self, photograph: usize, uses: &[Option<PixelUse>]) -> Vec<Pixel> {
        let width = self.picture.width;
        let step = (self.ball.radius * DIRECTION_ERROR).round().max(1.0);
        let light = |[x, y]: [f64; 2]| {
            let index = (y * width as f64 + x) as usize;
            let is_inside = x >= 0.0 && x < width as f64 && y >= 0.0;
            let is_used = is_inside && uses.get(index) == Some(&Some(PixelUse::Used));
            is_used.then(|| logarithm(self.radiance(index)))
        };
        let of_pixel = |index: usize| {
            let [x, y] = self.picture.place(index);
            let own = light([x, y])?;
            let view = self.ball.view([x, y])?;
            let change = [[step, 0.0], [0.0, step]].map(|[right, down]| {
                let sides = [1.0, -1.0].map(|side| light([x + side * right, y + side * down]));
                let change = match sides {
                    [Some(one), Some(other)] => 0.5 * (one - other),
                    [one, other] => one.or(other).map_or(0.0, |one| one - own),
                };
                change * change
            });
            let cosine = dot(view.normal, self.light.direction);
            Some(Pixel {
                angles: view.angles(self.light.direction)?.map(f64::from),
                brdf: self.radiance(index).map(|light| light / cosine),
                logarithm: own - cosine.ln(),
                change: change.iter().sum(),
                photograph,
                index,
            })
        };
        (0..uses.len()).filter_map(of_pixel).collect()
    }
}

/// Returns the logarithm of the light of all channels. That of black pixels is finite.
fn logarithm(light: [f64; 3]) -> f64 {
    (light.iter().sum::<f64>() / 3.0).max(1e-4).ln()
}

/// Chooses readings of pixels that are used, in strata of theta_h, phi_d, and the photographs, whose theta_d differ.
///
/// Strata are dense where theta_h is small, near the highlight, and each has the same part of its directions. Those on both
/// sides of the plane of light and camera are one, because errors of normals and light have opposite signs there. Pixels unlike
/// their stratum become outliers in `uses`.
#[must_use]
pub fn choose(photographs: &[Photograph], uses: &mut [Vec<Option<PixelUse>>]) -> Vec<PhotoReading> {
    let pairs = photographs.iter().zip(&*uses).enumerate();
    let mut pixels: Vec<Pixel> = pairs
        .flat_map(|(index, (photograph, uses))| photograph.pixels(index, uses))
        .collect();
    for pixel in &mut pixels {
        let phi_d = pixel.angles.phi_d.rem_euclid(TAU);
        pixel.angles.phi_d = phi_d.min(TAU - phi_d);
    }
    let strata = |rings: f64| {
        let mut strata: BTreeMap<[usize; 3], Vec<&Pixel>> = BTreeMap::new();
        for pixel in &pixels {
            let ring = ((pixel.angles.theta_h / FRAC_PI_2).sqrt() * rings).floor();
            let middle = ((ring + 0.5) / rings).powi(2) * FRAC_PI_2;
            let sectors = (0.25 * rings * middle.sin()).round().max(1.0);
            let sector = (pixel.angles.phi_d / PI * sectors).min(sectors - 1.0);
            let key = [pixel.photograph, ring as usize, sector as usize];
            strata.entry(key).or_default().push(pixel);
        }
        strata
    };
    let (mut fewer, mut more) = (1.0_f64, 400.0_f64);
    for _ in 0..16 {
        let rings = (fewer * more).sqrt();
        if strata(rings).len() > READINGS {
            more = rings;
        } else {
            fewer = rings;
        }
    }
    let mut readings = Vec::new();
    for pixels in strata(fewer).into_values() {
        let (usual, strange) = split(&pixels);
        readings.extend(mean(&usual));
        for pixel in strange {
            uses[pixel.photograph][pixel.index] = Some(PixelUse::Outlier);
        }
    }
    readings
}

/// Splits a stratum in pixels that are like its median, and others.
fn split<'a>(pixels: &[&'a Pixel]) -> (Vec<&'a Pixel>, Vec<&'a Pixel>) {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or_default()
    };
    let middle = median(pixels.iter().map(|pixel| pixel.logarithm).collect());
    let distance = |pixel: &Pixel| (pixel.logarithm - middle).abs();
    let spread = median(pixels.iter().map(|pixel| distance(pixel)).collect());
    let largest = MIN_CONTRAST.max(MAX_SPREADS * spread);
    pixels.iter().partition(|pixel| distance(pixel) <= largest)
}

/// Returns the mean of a stratum. None if its direction is too near the horizon, or it is black.
fn mean(pixels: &[&Pixel]) -> Option<PhotoReading> {
    let mean = |value: &dyn Fn(&Pixel) -> f64| {
        pixels.iter().map(|pixel| value(pixel)).sum::<f64>() / pixels.len() as f64
    };
    let angles = Angles {
        theta_h: mean(&|pixel| pixel.angles.theta_h),
        theta_d: mean(&|pixel| pixel.angles.theta_d),
        phi_d: mean(&|pixel| pixel.angles.phi_d),
    };
    let brdf = [0, 1, 2].map(|channel| mean(&|pixel| pixel.brdf[channel]).max(0.0));
    let at = HalfDifference::from_angles(angles);
    let lowest = at.cos_theta_i().min(at.cos_theta_o());
    let of_mean = mean(&|pixel| pixel.logarithm);
    let distance = |pixel: &Pixel| (pixel.logarithm - of_mean).powi(2);
    let furthest = |one: &&&Pixel, other: &&&Pixel| distance(one).total_cmp(&distance(other));
    let strangest = pixels.iter().max_by(furthest)?;
    let of_pixels = mean(&distance) / pixels.len() as f64;
    let noise = (SHARED_NOISE.powi(2) + mean(&|pixel| pixel.change) + of_pixels).sqrt();
    let is_usable = lowest > 0.8 * MIN_COSINE && brdf.iter().sum::<f64>() > 0.0;
    is_usable.then(|| PhotoReading {
        angles,
        brdf,
        noise: noise.min(MAX_NOISE),
        photograph: strangest.photograph,
        index: strangest.index,
    })
}
