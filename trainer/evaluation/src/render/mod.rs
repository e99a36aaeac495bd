//! Renderings of spheres in a built-in studio, and photographs under a distant light.
//!
//! [`render_sphere`] integrates a BRDF over the studio's light and returns an [`Image`] of linear radiance.
//! [`Image::tone_map`] converts it to an 8-bit [`Picture`] for display, PNG files and image metrics.
//! [`photograph`] is a camera's view of a ball.

mod comparison;
mod environment;
mod image;
mod overview;
mod photograph;
mod picture;
mod quadrature;
mod sheet;
mod sphere;
mod studio;
#[cfg(test)]
mod tests;

pub use comparison::compare_photographs;
pub use image::Image;
pub use overview::overview;
pub use photograph::{distant_ball, photograph};
pub use picture::{Picture, PictureError, Raster};
pub use sphere::{render_sphere, sphere_disc};
