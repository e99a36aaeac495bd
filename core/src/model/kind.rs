//! Kinds of models.

use serde::{Deserialize, Serialize};

/// The kind of a model, in recipes and on the link. The numbers of the models that are fitted by descent are part of
/// the recipe format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelKind {
    /// [`Phong`](super::Phong).
    Phong = 0,
    /// [`Neural`](super::Neural).
    Neural = 1,
    /// [`CookTorrance`](super::CookTorrance).
    CookTorrance = 2,
    /// Principal components: the only model without parameters of its own. Recipes do not contain its number.
    Linear = 3,
}

impl ModelKind {
    /// Returns the name on the command line and in exported files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Phong => "phong",
            Self::Neural => "neural",
            Self::CookTorrance => "cook-torrance",
            Self::Linear => "linear",
        }
    }
}

impl core::fmt::Display for ModelKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
