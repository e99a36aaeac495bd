//! Materials: what is measured, or measured-looking, and where to read it from.

mod merl;
mod nbrdf;
mod procedural;
mod source;

pub use merl::{MerlTable, write_merl};
pub use nbrdf::NeuralBrdf;
pub use procedural::Procedural;
pub use source::{Source, SourceError};

use glimpse_core::angles::Angles;

/// A measured material: a BRDF that can be looked up anywhere, with its derivative.
pub trait Material: Send + Sync {
    /// Its name: the stem of the file it was read from.
    fn name(&self) -> &str;

    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians.
    fn brdf(&self, angles: Angles<f32>) -> [f32; 3];

    /// The BRDF, and its derivative by theta_h, theta_d and phi_d for each channel.
    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]);
}
