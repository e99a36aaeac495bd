//! The parameters of each model.

use core::ops::Range;

use super::{Active, CookTorrance, Model, ModelKind, Neural, Phong};

impl ModelKind {
    /// Number of parameters of the model. None for Linear: its recipe determines the number of coefficients, one per
    /// component and channel.
    #[must_use]
    pub const fn parameters(self) -> Option<usize> {
        match self {
            Self::Phong => Some(Phong::PARAMETERS),
            Self::Neural => Some(Neural::PARAMETERS),
            Self::CookTorrance => Some(CookTorrance::PARAMETERS),
            Self::Linear => None,
        }
    }

    /// The parameters that a Gauss-Newton step changes. None for Linear.
    #[must_use]
    pub(crate) const fn active(self) -> Option<Active> {
        match self {
            Self::Phong => Some(Phong::ACTIVE),
            Self::Neural => Some(Neural::ACTIVE),
            Self::CookTorrance => Some(CookTorrance::ACTIVE),
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
