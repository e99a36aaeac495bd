//! Readings of photographs: each pixel of a ball under a distant light has its own normal, and so its own directions.

mod ball;
mod choose;
mod chrome;
mod circle;
mod lamps;
mod lights;
mod picture;
mod scale;

pub use ball::{Ball, Camera, PixelView};
pub use choose::{PhotoReading, PixelUse, choose};
pub use chrome::{ChromeError, chrome_light};
pub use lamps::next_lamps;
pub use lights::Light;
pub use picture::LinearPicture;
pub use scale::{WhiteShape, set_albedo};

/// A photograph of a ball.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// The name in reports.
    pub name: String,
    /// The pixels. Those of a saturated sensor are infinite, and unknown ones NaN.
    pub picture: LinearPicture,
    /// The light. Without an intensity, pixels are the BRDF times cos(theta_i).
    pub light: Light,
    /// The ball.
    pub ball: Ball,
}
