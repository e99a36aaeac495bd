//! Errors of scans, fits and tables, with messages for the page.

use core::fmt;

use glimpse_core::error::Error;

/// An error of core, or of the page's calls.
pub(crate) enum SceneError {
    NoBuffer,
    NoScan,
    Core(Error),
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBuffer => {
                f.write_str("the buffer is not allocated or too small: call allocate first")
            }
            Self::NoScan => f.write_str("the instance has no scan: call load_recipe first"),
            Self::Core(error) => error.fmt(f),
        }
    }
}

impl From<Error> for SceneError {
    fn from(error: Error) -> Self {
        Self::Core(error)
    }
}
