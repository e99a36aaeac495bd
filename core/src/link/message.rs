//! Messages of the link.

use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorCode};
use crate::fit::Progress;
use crate::geometry::Directions;
use crate::gonio::Reading;
use crate::model::ModelKind;
use crate::scan::Residual;

/// The protocol version of this crate.
///
/// `Hello` and `Welcome` stay first in their enums and never change their layout, so that any two versions recognize
/// each other.
pub const PROTOCOL: u16 = 7;

/// The largest number of values in one [`Request::Values`]. A line that loses one byte in a
/// hundred delivers about half of all frames of 80 bytes, and an eighth of those of 200 bytes.
pub const VALUES_PER_FRAME: usize = 16;
/// The values in one [`Request::Values`].
pub type Values = heapless::Vec<f32, VALUES_PER_FRAME>;

/// The purpose of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Purpose {
    /// A reading for the fit.
    Sample,
    /// A reading with the lamp off, at directions of a sample: 0, but for room light and noise.
    Dark,
    /// The first sample again: the same reading, unless lamp, room light or axes have drifted.
    Again,
}

/// A request of the device. `core/docs/link.md` has the numbers of all messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Begins a scan. The host discards the previous scan.
    Hello {
        /// The device's [`PROTOCOL`].
        protocol: u16,
        /// The model that the device fits.
        model: ModelKind,
        /// Number of samples of the recipe's pattern.
        samples: u16,
        /// The checksum in the recipe's header, which names the recipe.
        recipe: u32,
    },
    /// Requests a reading at these directions.
    Measure {
        /// Its purpose. The lamp is off for [`Purpose::Dark`].
        purpose: Purpose,
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Directions of light and sensor.
        directions: Directions<f32>,
    },
    /// Progress of the fit.
    Progress(Progress),
    /// Some of the fitted values: a model's parameters in its order, or Linear's coefficients, m for red, m for green,
    /// m for blue.
    Values {
        /// Index of the first value in `values`.
        offset: u16,
        /// Number of all values.
        total: u16,
        /// The values.
        values: Values,
    },
    /// Ends the scan, after all values.
    Finished(Residual),
    /// The scan has failed.
    Failed(Error),
    /// Asks if a reading from before a reset is still valid, because the material may have changed.
    Restored {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
}

/// A reply of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Reply {
    /// Replies to [`Request::Hello`].
    Welcome {
        /// The host's [`PROTOCOL`].
        protocol: u16,
    },
    /// Replies to [`Request::Measure`].
    Measured {
        /// The request's index.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// Replies to all other requests.
    Accepted,
    /// Refuses the request: [`ErrorCode::RefusedNoScan`] to [`ErrorCode::RefusedRequest`], or a reason that this version
    /// does not know.
    Refused(ErrorCode),
    /// Replies to [`Request::Measure`]: this sample cannot be read. The device continues without it if the recipe
    /// tolerates missing readings. Otherwise the scan fails.
    Skip {
        /// The request's index.
        index: u16,
    },
    /// Replies to [`Request::Measure`]: the device fits the recorded readings if the recipe tolerates missing
    /// readings. Otherwise the scan fails.
    FinishEarly,
}

impl Reply {
    /// Returns true if this kind of reply answers `request`.
    #[must_use]
    pub fn answers(&self, request: &Request) -> bool {
        match (self, request) {
            (Self::Refused(_), _) | (Self::Welcome { .. }, Request::Hello { .. }) => true,
            (
                Self::Measured { index, .. } | Self::Skip { index },
                Request::Measure {
                    index: requested, ..
                },
            ) => index == requested,
            (Self::FinishEarly, Request::Measure { .. }) => true,
            (Self::Accepted, Request::Hello { .. } | Request::Measure { .. }) => false,
            (Self::Accepted, _) => true,
            _ => false,
        }
    }
}
