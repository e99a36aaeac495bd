//! The kinds of sections, by number.

use serde::{Deserialize, Serialize};

/// The kind of a section of a recipe.
///
/// Kinds below 128 are required: a reader refuses a recipe with an unknown required kind. Kinds from 128 on are
/// optional: a reader skips sections of unknown optional kinds. A number is never reused, and the content of a kind
/// never changes. `core/docs/recipe.md` describes how to add a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Kind(u16);

impl Kind {
    /// The directions to measure.
    pub const PATTERN: Self = Self(0);
    /// A few steps of SGD, alone or with [`Kind::COMPLETION`] and [`Kind::START`].
    pub const DESCENT: Self = Self(1);
    /// A ridge solve, which fits the model Linear. It excludes [`Kind::DESCENT`] and [`Kind::COMPLETION`].
    pub const RIDGE: Self = Self(2);
    /// A learned map from readings to coefficients. Alone, it fits the model Linear. With [`Kind::START`], it
    /// determines the start of the recipe's [`Kind::DESCENT`] or [`Kind::GAUSS_NEWTON`].
    pub const COMPLETION: Self = Self(3);
    /// A learned map from a completion's coefficients to initial parameters of a descent or of Gauss-Newton steps.
    pub const START: Self = Self(4);
    /// Gauss-Newton steps toward virtual readings and those of the pattern, with [`Kind::COMPLETION`] and
    /// [`Kind::START`].
    pub const GAUSS_NEWTON: Self = Self(5);
    /// A correction of a completion's coefficients by the residuals of the readings.
    pub const CORRECTION: Self = Self(6);
    /// The expected loss.
    pub const EXPECTATION: Self = Self(130);
    /// The weights that map a completion's coefficients to the predicted loss.
    pub const PREDICTION: Self = Self(133);
    /// The evidence of the readings for the loss of a completed fit.
    pub const UNCERTAINTY: Self = Self(135);
    /// A mark that the samples are in the order of a path that takes little time. Its content is ignored.
    pub const PATH_ORDER: Self = Self(136);
    /// The loss of completed fits with some of the readings.
    pub const PARTIAL: Self = Self(137);
    /// The trainer's metadata: bytes that only the trainer reads.
    pub const METADATA: Self = Self(138);

    const FIRST_OPTIONAL: Self = Self(128);

    /// Creates a kind from its number, known or not.
    #[must_use]
    pub const fn new(number: u16) -> Self {
        Self(number)
    }

    /// Returns the number in the recipe's bytes.
    #[must_use]
    pub const fn number(self) -> u16 {
        self.0
    }

    /// Returns true if a reader must know the kind to read a recipe with such a section.
    #[must_use]
    pub fn is_required(self) -> bool {
        self < Self::FIRST_OPTIONAL
    }

    /// Returns the name, or None for an unknown kind.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        Some(match self {
            Self::PATTERN => "pattern",
            Self::DESCENT => "descent",
            Self::RIDGE => "ridge",
            Self::COMPLETION => "completion",
            Self::START => "start",
            Self::GAUSS_NEWTON => "gauss_newton",
            Self::CORRECTION => "correction",
            Self::EXPECTATION => "expectation",
            Self::PREDICTION => "prediction",
            Self::UNCERTAINTY => "uncertainty",
            Self::PATH_ORDER => "path_order",
            Self::PARTIAL => "partial",
            Self::METADATA => "metadata",
            _ => return None,
        })
    }
}

impl core::fmt::Display for Kind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({name})", self.0),
            None => write!(f, "{}", self.0),
        }
    }
}
