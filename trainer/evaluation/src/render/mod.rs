//! Renderings of spheres in a built-in studio.
//!
//! [`render_sphere`] integrates a BRDF over the studio's light and returns an [`Image`] of linear radiance.
//! [`Image::tone_map`] converts it to an 8-bit [`Picture`] for display, PNG files and image metrics.

mod environment;
mod image;
mod picture;
mod quadrature;
mod sphere;
mod studio;
#[cfg(test)]
mod tests;

pub use image::Image;
pub use picture::{Picture, PictureError, Raster};
pub use sphere::{render_sphere, sphere_disc};
