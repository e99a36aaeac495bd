//! Failures of a scan on the link.

use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorCode};

/// A failure on the link: the number of its [`ErrorCode`], and the error's details.
///
/// A host receives and prints codes that it does not know.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::link::FailureReport;
///
/// let error = Error::with(ErrorCode::OutOfReach, [3, 2]);
/// let report = FailureReport::from(error);
/// assert_eq!((report.code, report.details), (105, [3, 2]));
/// assert_eq!(report.error(), Some(error));
///
/// let newer = FailureReport { code: 999, details: [7, 0] };
/// assert_eq!(newer.error(), None);
/// assert_eq!(newer.to_string(), "error 999, which this host does not know: update the host (details: 7, 0)");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FailureReport {
    /// The number of an error code.
    pub code: u16,
    /// The error's details.
    pub details: [u32; 2],
}

impl FailureReport {
    /// The error; None if this version does not know the code.
    #[must_use]
    pub fn error(&self) -> Option<Error> {
        let code = ErrorCode::from_number(self.code)?;
        Some(Error::with(code, self.details))
    }
}

impl From<Error> for FailureReport {
    fn from(error: Error) -> Self {
        Self {
            code: error.code as u16,
            details: error.details,
        }
    }
}

impl core::fmt::Display for FailureReport {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { code, details } = self;
        let [first, second] = details;
        match self.error() {
            Some(error) => write!(f, "error {code}: {error}"),
            None => write!(
                f,
                "error {code}, which this host does not know: update the host (details: {first}, {second})"
            ),
        }
    }
}
