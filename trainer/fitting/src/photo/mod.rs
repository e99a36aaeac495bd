//! Readings of photographs: each pixel of a ball under a distant light has its own normal, and so its own directions.

mod ball;
mod chrome;
mod lights;
mod picture;

pub use ball::{Ball, Camera, View};
pub use chrome::{ChromeError, chrome_light};
pub use lights::Light;
pub use picture::{LinearPicture, PictureFileError, PictureProblem};
