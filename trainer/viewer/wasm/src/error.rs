//! Why a scan, a fit or a table comes to nothing, as the page says it.

use core::fmt;

use glimpse_core::model::linear::BasisError;
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FinishError, FitError, ReadingError, ScanError};

/// Why something comes to nothing: core's reasons, and two of the page's own.
pub(crate) enum SceneError {
    NoRoom,
    NoScan,
    Recipe(RecipeError),
    Basis(BasisError),
    Scan(ScanError),
    Reading(ReadingError),
    Fit(FitError),
    Finish(FinishError),
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRoom => f.write_str("the room for it was not asked for, or is too small"),
            Self::NoScan => f.write_str("no scan was begun"),
            Self::Recipe(error) => error.fmt(f),
            Self::Basis(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Reading(error) => error.fmt(f),
            Self::Fit(error) => error.fmt(f),
            Self::Finish(error) => error.fmt(f),
        }
    }
}

macro_rules! from {
    ($($error:ident => $reason:ident),*) => {$(
        impl From<$error> for SceneError {
            fn from(error: $error) -> Self {
                Self::$reason(error)
            }
        }
    )*};
}

from!(RecipeError => Recipe, BasisError => Basis, ScanError => Scan, ReadingError => Reading, FitError => Fit, FinishError => Finish);
