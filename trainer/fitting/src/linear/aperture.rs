//! Readings that are means of the BRDF over directions, as those of gloss meters, spheres and large detectors.

use glimpse_core::geometry::Angles;
use glimpse_materials::half_differences;
use glimpse_materials::{Brdf, luminance};

/// The directions of a reading, which is the mean of the BRDF over them.
#[derive(Clone, Debug, PartialEq)]
pub struct Aperture {
    /// The directions, angles in radians, and their shares of the mean, which add up to 1.
    pub directions: Vec<(Angles<f32>, f64)>,
    /// True if the reading is that of the luminance, so that it states nothing about the color.
    pub is_gray: bool,
    /// The standard deviation of the noise that does not depend on the reading, sr^-1.
    pub resolution: f64,
}

impl Aperture {
    /// Returns the mean of a BRDF in linear RGB, sr^-1, not times the cosine; its luminance three times if the reading is gray.
    pub fn mean(&self, brdf: &dyn Brdf) -> [f32; 3] {
        let angles = self.directions.iter().map(|(angles, _)| *angles);
        let values = brdf.values_at(&half_differences(angles));
        let pairs = values.iter().zip(&self.directions);
        let mean = [0, 1, 2].map(|channel: usize| {
            let terms = pairs.clone();
            let terms = terms.map(|(rgb, (_, share))| share * f64::from(rgb[channel]));
            terms.sum::<f64>() as f32
        });
        if self.is_gray {
            [luminance(mean); 3]
        } else {
            mean
        }
    }
}
