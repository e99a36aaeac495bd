//! Linear pictures of cameras.

/// A picture whose pixels are proportional to radiance.
#[derive(Clone, Debug)]
pub struct LinearPicture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear RGB as fractions of the sensor's full scale, row by row from the top left.
    pub pixels: Vec<[f32; 3]>,
}
