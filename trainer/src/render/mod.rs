//! Renderings of spheres under an environment.
//!
//! [`render_sphere`] integrates a BRDF over an [`Environment`] and returns an [`Image`] of linear radiance.
//! [`Image::tone_map`] converts it to an 8-bit [`Picture`] for display, PNG files and image metrics.

#[cfg_attr(
    not(feature = "program"),
    expect(dead_code, reason = "only the program reads light from files")
)]
mod environment;
mod image;
mod octahedral;
#[cfg(feature = "program")]
mod panorama;
mod picture;
mod quadrature;
mod sphere;
mod studio;
#[cfg(test)]
mod tests;

pub use environment::Environment;
pub use image::Image;
#[cfg(feature = "program")]
pub use panorama::EnvironmentError;
pub use picture::{Picture, PictureError};
pub use sphere::{render_sphere, sphere_disc};
