//! Shading models and their BRDFs.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::Brdf;

use super::cosines::Cosines;
use super::parameter::Parameter;
use super::{gltf, open_pbr, principled};

/// A shading model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadingModel {
    /// Mitsuba 3's BSDF `principled`, which is Disney's.
    Principled,
    /// The material of glTF 2.0 with the extensions `KHR_materials_specular` and `KHR_materials_clearcoat`.
    Gltf,
    /// OpenPBR 1.1, MaterialX's node `open_pbr_surface`.
    OpenPbr,
}

impl ShadingModel {
    /// All models.
    pub const ALL: [Self; 3] = [Self::Principled, Self::Gltf, Self::OpenPbr];

    /// Returns the ending of a file's name.
    pub(crate) fn suffix(self) -> &'static str {
        match self {
            Self::Principled => "_principled.json",
            Self::Gltf => ".gltf",
            Self::OpenPbr => ".mtlx",
        }
    }

    /// Returns the parameters in order.
    #[must_use]
    pub fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::Principled => &principled::PARAMETERS,
            Self::Gltf => &gltf::PARAMETERS,
            Self::OpenPbr => &open_pbr::PARAMETERS,
        }
    }

    /// Returns the BRDF in linear RGB, sr^-1, not times the cosine.
    pub(super) fn brdf(self, values: &[f64], at: &Cosines) -> [f64; 3] {
        match self {
            Self::Principled => principled::brdf(values, at),
            Self::Gltf => gltf::brdf(values, at),
            Self::OpenPbr => open_pbr::brdf(values, at),
        }
    }
}

/// A shading model with parameters: a BRDF.
#[derive(Clone, Debug, PartialEq)]
pub struct Shading {
    /// The model.
    pub model: ShadingModel,
    /// The values of the parameters, in the order of [`ShadingModel::parameters`].
    pub values: Vec<f64>,
}

impl Brdf for Shading {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let brdf = |at| self.model.brdf(&self.values, &Cosines::of(at));
        let values = at.iter().map(brdf);
        values.map(|rgb| rgb.map(|value| value as f32)).collect()
    }
}
