//! Detection of data leakage: test materials that a recipe was trained on.

use std::collections::HashSet;

use glimpse_core::recipe::Recipe;
use glimpse_fitting::recipe::{Metadata, MetadataError};
use glimpse_materials::{Identity, Material};
use serde::{Deserialize, Serialize};

/// The names and digests of the materials that a recipe was trained on.
#[derive(Clone, Debug, Default)]
pub struct TrainingMaterials {
    names: HashSet<String>,
    digests: HashSet<u32>,
}

/// An overlap of a test material with the training materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainingOverlap {
    /// A training material has the same BRDF, under any name.
    SameBrdf,
    /// A training material has the same name but another BRDF: possibly another measurement of the same material, or the
    /// same measurement in another format.
    SameName,
    /// No training material has the same BRDF or name.
    Unseen,
}

impl TrainingMaterials {
    /// Reads the list in a recipe; None if the recipe has none, for example because it was stripped for flash.
    ///
    /// # Errors
    /// If the recipe's metadata are invalid.
    pub fn from_recipe(recipe: &Recipe<'_>) -> Result<Option<Self>, MetadataError> {
        let materials = Metadata::of(recipe)?.materials;
        Ok((!materials.is_empty()).then(|| materials.into_iter().collect()))
    }

    /// Returns the overlap of a material with the training materials.
    #[must_use]
    pub fn overlap(&self, material: &dyn Material) -> TrainingOverlap {
        let Identity { name, digest } = Identity::new(material);
        if self.digests.contains(&digest) {
            TrainingOverlap::SameBrdf
        } else if self.names.contains(&name) {
            TrainingOverlap::SameName
        } else {
            TrainingOverlap::Unseen
        }
    }
}

impl FromIterator<Identity> for TrainingMaterials {
    fn from_iter<I: IntoIterator<Item = Identity>>(materials: I) -> Self {
        let (names, digests) = materials
            .into_iter()
            .map(|Identity { name, digest }| (name, digest))
            .unzip();
        Self { names, digests }
    }
}
