//! How many parameters each model has.

use super::{CookTorrance, Model, ModelKind, Neural, Phong};

impl ModelKind {
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
}
