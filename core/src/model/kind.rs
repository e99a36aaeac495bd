//! The models by name.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use super::{CookTorrance, Model, Neural, Phong};

/// Names a model in recipes and on the link. The order of those that are fitted by descent is part
/// of the recipe format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModelKind {
    /// [`Phong`].
    Phong,
    /// [`Neural`].
    Neural,
    /// [`CookTorrance`].
    CookTorrance,
    /// Principal components and a ridge solve: the one model that has no descent. Recipes do not write its number, so
    /// that it may stay the last.
    Linear,
}

impl ModelKind {
    /// The name on the command line and in exported files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Phong => "phong",
            Self::Neural => "neural",
            Self::CookTorrance => "cook-torrance",
            Self::Linear => "linear",
        }
    }

    /// How many parameters the model has. None for Linear: as many as its recipe says, a
    /// coefficient for each component and channel.
    #[must_use]
    pub const fn parameters(self) -> Option<usize> {
        match self {
            Self::Phong => Some(Phong::PARAMETERS),
            Self::Neural => Some(Neural::PARAMETERS),
            Self::CookTorrance => Some(CookTorrance::PARAMETERS),
            Self::Linear => None,
        }
    }

    /// The parameters that come in triples of red, green and blue.
    pub(crate) fn colors(self) -> Range<usize> {
        match self {
            Self::Phong | Self::CookTorrance => 0..6,
            Self::Neural => Neural::PARAMETERS - Neural::COLORS..Neural::PARAMETERS,
            Self::Linear => 0..0,
        }
    }
}

impl core::fmt::Display for ModelKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
