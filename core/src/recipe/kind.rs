//! The kinds of sections, by number.

use serde::{Deserialize, Serialize};

/// The kind of a section of a recipe.
///
/// Numbers below 128 are required: who does not know such a kind cannot read the recipe. Numbers
/// from 128 on are optional: who does not know such a kind passes over the section. A number is
/// never used for anything else, and what a kind holds never changes; `core/docs/recipe.md` says
/// how to add one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Kind(u16);

impl Kind {
    /// Where to measure.
    pub const PATTERN: Self = Self(0);
    /// A few steps of SGD; a recipe has this or [`Kind::RIDGE`].
    pub const DESCENT: Self = Self(1);
    /// A ridge solve, the model Linear; a recipe has this or [`Kind::DESCENT`] or
    /// [`Kind::COMPLETION`].
    pub const RIDGE: Self = Self(2);
    /// What completes readings: by itself the model Linear, or with [`Kind::START`] where the recipe's
    /// [`Kind::DESCENT`] starts.
    pub const COMPLETION: Self = Self(3);
    /// From a completion to where a descent starts.
    pub const START: Self = Self(4);
    /// The machine that the pattern was made for.
    pub const LIMITS: Self = Self(128);
    /// The noise that it was trained for.
    pub const NOISE: Self = Self(129);
    /// The loss to expect.
    pub const EXPECTATION: Self = Self(130);
    /// Where it came from.
    pub const PROVENANCE: Self = Self(131);
    /// Names and digests of the materials that it was trained on.
    pub const MATERIALS: Self = Self(132);
    /// From a completion to the loss that a fit is likely to have.
    pub const PREDICTION: Self = Self(133);
    /// The training, in types.
    pub const TRAINING: Self = Self(134);

    const FIRST_OPTIONAL: Self = Self(128);

    /// The kind with this number, known or not.
    #[must_use]
    pub const fn new(number: u16) -> Self {
        Self(number)
    }

    /// Its number in the recipe's bytes.
    #[must_use]
    pub const fn number(self) -> u16 {
        self.0
    }

    /// True if a recipe with a section of this kind cannot be read without knowing the kind.
    #[must_use]
    pub fn is_required(self) -> bool {
        self < Self::FIRST_OPTIONAL
    }

    /// Its name; None for a kind that this crate does not know.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        Some(match self {
            Self::PATTERN => "pattern",
            Self::DESCENT => "descent",
            Self::RIDGE => "ridge",
            Self::COMPLETION => "completion",
            Self::START => "start",
            Self::LIMITS => "limits",
            Self::NOISE => "noise",
            Self::EXPECTATION => "expectation",
            Self::PROVENANCE => "provenance",
            Self::MATERIALS => "materials",
            Self::PREDICTION => "prediction",
            Self::TRAINING => "training",
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
