//! Linear pictures of cameras.

use glimpse_materials::lists::add_scaled;

/// A picture whose pixels are proportional to radiance.
#[derive(Clone, Debug)]
pub struct LinearPicture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear RGB as fractions of the sensor's full scale, row by row from the top left. Floats may be negative (noise below
    /// the black level) or above 1.
    pub pixels: Vec<[f32; 3]>,
}

impl LinearPicture {
    /// Returns the column and row of a pixel.
    #[must_use]
    pub fn place(&self, index: usize) -> [f64; 2] {
        [index % self.width, index / self.width].map(|side| side as f64)
    }

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
