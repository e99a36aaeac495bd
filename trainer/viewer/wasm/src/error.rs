//! Errors of scans, fits and tables, with messages for the page.

use glimpse_core::error::Error;

/// An error of core, or of the page's calls.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SceneError {
    #[error("the buffer is not allocated or too small: call allocate first")]
    NoBuffer,
    #[error("the instance has no scan: call load_recipe first")]
    NoScan,
    #[error(transparent)]
    Core(#[from] Error),
}
