//! Shading models of renderers, and their parameters that approximate a BRDF.
//!
//! - [`ShadingModel`]: Mitsuba's `principled`, glTF 2.0 and OpenPBR;
//! - [`Shading`]: a model with parameters, which is a BRDF;
//! - [`fit`]: the parameters that approximate another BRDF best.
//!
//! All of them are isotropic and opaque. A BRDF then depends only on four cosines.

mod albedo;
mod cosines;
mod fit;
mod fresnel;
mod gltf;
mod microfacets;
mod model;
mod open_pbr;
mod principled;
mod sphere_mesh;
mod write;

pub(crate) use cosines::Cosines;
pub use fit::{ShadingError, fit};
pub(crate) use fresnel::schlick;
pub(crate) use microfacets::separable_lobe;
pub use model::{Parameter, Shading, ShadingModel};
