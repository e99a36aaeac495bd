//! Reasons why a host refuses a request.

use serde::{Deserialize, Serialize};

use crate::error_code::ErrorCode;

/// A reason why the host refuses a request. The link transmits its [code](Refusal::code)'s number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(from = "u16", into = "u16")]
#[non_exhaustive]
pub enum Refusal {
    /// No scan has begun: the host was started in the middle of a scan, and waits for a hello.
    NoScan,
    /// The scanner cannot reach these directions.
    Directions,
    /// The number of values is not the model's, or not the announced one.
    Values,
    /// The host does not support this model.
    Model,
    /// The host has not sent this reading in the scan that it knows. The device has to take all readings again.
    Saved,
    /// The recipe is not the one that the host offered.
    Recipe,
    /// The host does not support this request.
    Request,
    /// A reason that this version does not know.
    Other {
        /// The number of the reason.
        code: u16,
    },
}

impl Refusal {
    /// The code; [`ErrorCode::RefusedOther`] for an unknown reason.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::NoScan => ErrorCode::RefusedNoScan,
            Self::Directions => ErrorCode::RefusedDirections,
            Self::Values => ErrorCode::RefusedValues,
            Self::Model => ErrorCode::RefusedModel,
            Self::Saved => ErrorCode::RefusedSaved,
            Self::Recipe => ErrorCode::RefusedRecipe,
            Self::Request => ErrorCode::RefusedRequest,
            Self::Other { .. } => ErrorCode::RefusedOther,
        }
    }
}

impl From<u16> for Refusal {
    fn from(code: u16) -> Self {
        let refusals = [
            Self::NoScan,
            Self::Directions,
            Self::Values,
            Self::Model,
            Self::Saved,
            Self::Recipe,
            Self::Request,
        ];
        let mut refusals = refusals.into_iter();
        let refusal = refusals.find(|refusal| refusal.code().code() == code);
        refusal.unwrap_or(Self::Other { code })
    }
}

impl From<Refusal> for u16 {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Other { code } => code,
            refusal => refusal.code().code(),
        }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Other { code } => write!(f, "{} (number {code})", ErrorCode::RefusedOther),
            refusal => f.write_str(refusal.code().text()),
        }
    }
}
