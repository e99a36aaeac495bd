//! Detection of data leakage: test materials that a recipe was trained on.

use glimpse_materials::{Identity, Material};
use serde::{Deserialize, Serialize};

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

impl TrainingOverlap {
    /// Returns the overlap of a material with the training materials. None if they are unknown, which is an empty list: a
    /// recipe has none after it was stripped for flash.
    #[must_use]
    pub fn of(material: &dyn Material, trained_on: &[Identity]) -> Option<Self> {
        let identity = Identity::new(material);
        let mut others = trained_on.iter();
        let overlap = if others.clone().any(|other| other.digest == identity.digest) {
            Self::SameBrdf
        } else if others.any(|other| other.name == identity.name) {
            Self::SameName
        } else {
            Self::Unseen
        };
        (!trained_on.is_empty()).then_some(overlap)
    }
}
