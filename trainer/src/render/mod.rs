//! Renderings of spheres under an environment.
//!
//! [`render_sphere`] integrates a BRDF over an [`Environment`] and returns an [`Image`] of linear radiance.
//! [`Image::tone_map`] converts it to an 8-bit [`Picture`] for display, PNG files and image metrics.

mod environment;
mod image;
mod octahedral;
mod panorama;
mod picture;
mod quadrature;
mod sphere;
mod studio;
#[cfg(test)]
mod tests;

pub use environment::Environment;
pub use image::Image;
pub use panorama::EnvironmentError;
pub use picture::{Picture, PictureError};
pub use sphere::{BACKGROUND, render_sphere, sphere_disc};
