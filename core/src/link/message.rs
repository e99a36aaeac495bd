//! Messages of the link.

use serde::{Deserialize, Serialize};

use super::{FailureReport, RecipeBytes, Refusal, Values};
use crate::fit::Progress;
use crate::geometry::Directions;
use crate::model::ModelKind;
use crate::scan::{Reading, Residual};

/// The protocol version of this crate.
///
/// `Hello` and `Welcome` stay first in their enums and never change their layout, so that any two versions recognize
/// each other.
pub const PROTOCOL: u16 = 6;

/// A request of the device. `core/docs/link.md` has the numbers of all messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Request {
    /// Begins a scan; the host forgets the one before.
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
    /// Asks for a reading at these directions.
    Measure {
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
        /// Index of the first of them.
        offset: u16,
        /// Number of all values.
        total: u16,
        /// The values.
        values: Values,
    },
    /// Ends the scan, after all values.
    Finished(Residual),
    /// The device gives up on this scan.
    Failed(FailureReport),
    /// Asks whether a reading from before a reset is still valid; another material may be there now.
    Saved {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// Asks for another recipe to use from now on. A device that can store one asks after its hello.
    Update,
    /// Asks for the next bytes of that recipe.
    RecipePart {
        /// Number of bytes that the device has.
        offset: u32,
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
    /// Replies to all other requests. After [`Request::Update`] it states that there is no other recipe.
    Accepted,
    /// Refuses the request.
    Refused(Refusal),
    /// Replies to [`Request::Update`] if there is another recipe.
    Recipe {
        /// Its length in bytes.
        bytes: u32,
        /// The checksum in its header.
        checksum: u32,
    },
    /// Replies to [`Request::RecipePart`].
    RecipePart {
        /// The request's offset.
        offset: u32,
        /// The bytes from there on; fewer than [`BYTES_PER_FRAME`](super::BYTES_PER_FRAME) only at the end.
        bytes: RecipeBytes,
    },
    /// Replies to [`Request::Measure`]: this sample cannot be read. The device continues without it if the recipe
    /// tolerates missing readings; else it gives up.
    Skip {
        /// The request's index.
        index: u16,
    },
    /// Replies to [`Request::Measure`]: the device fits the readings taken so far, if the recipe tolerates missing
    /// readings; else it gives up.
    FinishEarly,
}

impl Reply {
    /// Returns true if `request` waits for this kind of reply.
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
            (
                Self::Accepted,
                Request::Hello { .. } | Request::Measure { .. } | Request::RecipePart { .. },
            ) => false,
            (Self::Recipe { .. }, Request::Update) => true,
            (Self::RecipePart { offset, .. }, Request::RecipePart { offset: requested }) => {
                offset == requested
            }
            (Self::Accepted, _) => true,
            _ => false,
        }
    }
}
