//! Errors of scans, fits and tables, with messages for the page.

use core::fmt;

use glimpse_core::model::linear::BasisError;
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FinishError, FitError, ReadingError, ScanError};

/// An error of core, or of the page's calls.
pub(crate) enum SceneError {
    NoBuffer,
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
            Self::NoBuffer => {
                f.write_str("the buffer is not allocated or too small: call allocate first")
            }
            Self::NoScan => f.write_str("the instance has no scan: call load_recipe first"),
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
