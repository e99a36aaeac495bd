//! Shading models, their parameters, and their BRDFs.

use std::sync::LazyLock;

use clap::ValueEnum;
use glimpse_core::geometry::HalfDifference;
use glimpse_materials::{Brdf, rows};
use serde::Deserialize;

use super::cosines::Cosines;
use super::{gltf, open_pbr, principled};

/// A parameter of a model.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Parameter {
    model: ShadingModel,
    /// The name in the model's files. The three channels of a color follow one another and have the same name.
    pub name: String,
    /// The smallest and the largest value.
    pub bounds: [f64; 2],
    /// The default of the format, which a file has if the parameter has no effect.
    pub(super) default: f64,
    /// The purpose, by which a fit starts.
    pub(super) role: Role,
}

/// The purpose of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Role {
    /// A channel of the color.
    BaseColor,
    /// The share of metal.
    Metallic,
    /// The roughness of the surface below a coat.
    Roughness,
    /// The weight of a coat.
    Coat,
    /// Any other, with the value at which a fit starts.
    #[serde(untagged)]
    Other(f64),
}

/// The parameters of all models.
static PARAMETERS: LazyLock<Vec<Parameter>> =
    LazyLock::new(|| rows(include_str!("parameters.csv")));

/// A shading model. Its documentation is that of the option of its format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum ShadingModel {
    /// NAME_principled.json: parameters of Mitsuba 3's BSDF `principled`, for load_dict
    Principled,
    /// NAME.gltf: a sphere with a material of glTF 2.0
    Gltf,
    /// NAME.mtlx: parameters of OpenPBR, in MaterialX
    OpenPbr,
}

impl ShadingModel {
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
        let mut models = PARAMETERS.chunk_by(|one, next| one.model == next.model);
        models
            .find(|parameters| parameters[0].model == self)
            .unwrap_or_default()
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
