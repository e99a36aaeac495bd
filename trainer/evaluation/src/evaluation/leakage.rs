//! Detection of data leakage: test materials that a recipe was trained on.

use std::collections::HashSet;

use glimpse_core::recipe::Recipe;
use glimpse_fitting::recipe::{Metadata, MetadataError};
use glimpse_materials::{Identity, Material};

/// The names and digests of the materials that a recipe was trained on.
#[derive(Clone, Debug, Default)]
pub struct TrainingMaterials {
    names: HashSet<String>,
    digests: HashSet<u32>,
}

/// An overlap of a test material with the training materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingOverlap {
    /// A training material has the same BRDF, under any name.
    SameBrdf,
    /// A training material has the same name but another BRDF: possibly another measurement of the same material, or the
    /// same measurement in another format.
    SameName,
}

impl TrainingMaterials {
    /// Reads the list in a recipe; None if the recipe has none, for example because it was stripped for flash.
    ///
    /// # Errors
    /// If the recipe's metadata are invalid.
    pub fn from_recipe(recipe: &Recipe<'_>) -> Result<Option<Self>, MetadataError> {
        let mut all = Self::default();
        for identity in Metadata::of(recipe)?.materials {
            all.add(identity);
        }
        Ok((!all.names.is_empty()).then_some(all))
    }

    /// Lists these materials.
    #[must_use]
    pub fn from_materials(materials: &[Box<dyn Material>]) -> Self {
        let mut all = Self::default();
        for material in materials {
            all.add(Identity::new(&**material));
        }
        all
    }

    fn add(&mut self, Identity { name, digest }: Identity) {
        self.names.insert(name);
        self.digests.insert(digest);
    }

    /// Returns the overlap of a material with the training materials; None if there is none.
    #[must_use]
    pub fn overlap(&self, material: &dyn Material) -> Option<TrainingOverlap> {
        let Identity { name, digest } = Identity::new(material);
        match (self.digests.contains(&digest), self.names.contains(&name)) {
            (true, _) => Some(TrainingOverlap::SameBrdf),
            (false, true) => Some(TrainingOverlap::SameName),
            (false, false) => None,
        }
    }
}
