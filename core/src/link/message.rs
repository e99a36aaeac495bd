//! What is said over the link.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::fit::Progress;
use crate::geometry::Directions;
use crate::model::ModelKind;
use crate::recipe::RecipeError;
use crate::scan::{FitError, Reading, ReadingError, Residual, ScanError};

/// The version of the protocol that this crate speaks.
///
/// `Hello` and `Welcome` stay first in their enums and never change their layout, so that any two
/// versions can tell each other apart.
pub const PROTOCOL: u16 = 5;
/// The largest number of values in one [`Request::Values`]. Of 80 bytes about half come
/// through whole where one in a hundred is lost; of 200 bytes an eighth would.
pub const VALUES_PER_FRAME: usize = 16;
/// The largest number of bytes in one [`Reply::RecipePart`].
pub const BYTES_PER_FRAME: usize = 60;

/// What the device asks for or tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request {
    /// A scan begins; whatever came before is forgotten.
    Hello {
        /// The device's [`PROTOCOL`].
        protocol: u16,
        /// The model that will be fitted.
        model: ModelKind,
        /// How many measurements it will ask for.
        samples: u16,
        /// The checksum in the recipe's header, which names it.
        recipe: u32,
    },
    /// Measure at these directions.
    Measure {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Where the light and the sensor have to be.
        directions: Directions<f32>,
    },
    /// How far the fit is.
    Progress(Progress),
    /// Some of the fitted values: a model's parameters in its order, or Linear's coefficients, m for
    /// red, m for green, m for blue.
    Values {
        /// Index of the first of them.
        offset: u16,
        /// How many there are in all.
        total: u16,
        /// The values.
        values: Vec<f32, VALUES_PER_FRAME>,
    },
    /// All values are told: the scan is over.
    Finished(Residual),
    /// The device gives up on this scan.
    Failed(Failure),
    /// Before it was reset, the device had this measurement of a scan by the same recipe. Does it
    /// hold still, or is another material there now?
    Saved {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// What the sensor saw.
        reading: Reading,
    },
    /// Is there another recipe that the device shall scan by from now on? It is asked after the hello
    /// of a device that can store one.
    Update,
    /// The next bytes of that recipe, please.
    RecipePart {
        /// How many bytes the device has.
        offset: u32,
    },
}

/// What the host answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reply {
    /// To [`Request::Hello`].
    Welcome {
        /// The host's [`PROTOCOL`].
        protocol: u16,
    },
    /// To [`Request::Measure`].
    Measured {
        /// The request's index.
        index: u16,
        /// What the sensor saw.
        reading: Reading,
    },
    /// To all other requests; to [`Request::Update`] it says that there is no other recipe.
    Accepted,
    /// The request cannot be met.
    Refused(Refusal),
    /// To [`Request::Update`]: there is one.
    Recipe {
        /// Its length in bytes.
        bytes: u32,
        /// The checksum in its header.
        checksum: u32,
    },
    /// To [`Request::RecipePart`].
    RecipePart {
        /// The request's offset.
        offset: u32,
        /// The bytes from there on; fewer than [`BYTES_PER_FRAME`] only at the end.
        bytes: Vec<u8, BYTES_PER_FRAME>,
    },
}

impl Reply {
    /// True if this is the kind of reply that `request` waits for.
    #[must_use]
    pub fn answers(&self, request: &Request) -> bool {
        match (self, request) {
            (Self::Refused(_), _) | (Self::Welcome { .. }, Request::Hello { .. }) => true,
            (Self::Measured { index, .. }, Request::Measure { index: asked, .. }) => index == asked,
            (
                Self::Accepted,
                Request::Hello { .. } | Request::Measure { .. } | Request::RecipePart { .. },
            ) => false,
            (Self::Recipe { .. }, Request::Update) => true,
            (Self::RecipePart { offset, .. }, Request::RecipePart { offset: asked }) => {
                offset == asked
            }
            (Self::Accepted, _) => true,
            _ => false,
        }
    }
}

/// Why the host refuses a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// No scan has begun: the host was started in the middle of one, and waits for a hello.
    NoScan,
    /// The scanner cannot reach these directions.
    Directions,
    /// They are more or fewer values than the model has, or than were said to come.
    Values,
    /// The host cannot do with this model.
    Model,
    /// The host did not give this measurement in the scan that it knows of: all have to be taken
    /// again.
    Saved,
    /// The recipe that it offered is not what it sends.
    Recipe,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NoScan => "no scan has begun: say hello first",
            Self::Directions => "the scanner cannot reach these directions",
            Self::Values => "the model has another number of values",
            Self::Model => "the host cannot do with this model",
            Self::Recipe => "the host sends another recipe than it offered",
            Self::Saved => "the host did not give this measurement: take all of them again",
        })
    }
}

/// Why the device gives up on a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Failure {
    /// Its recipe is damaged.
    Recipe(RecipeError),
    /// Its recipe is for another firmware.
    Scan(ScanError),
    /// The same reading was wrong too often.
    Reading {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// What was wrong with it last.
        error: ReadingError,
    },
    /// The readings cannot be fitted.
    Fit(FitError),
    /// The device's own arms or sensor failed.
    Machine,
    /// The host speaks another version of the protocol.
    Protocol {
        /// The device's.
        device: u16,
        /// The host's.
        host: u16,
    },
    /// The host refused a request.
    Refused(Refusal),
    /// The host did not reply, however often it was asked.
    NoReply,
    /// The fit left what numbers can hold: what was measured is nothing that the recipe can learn.
    Diverged,
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Recipe(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Reading { index, error } => write!(f, "reading {index}: {error}"),
            Self::Fit(error) => error.fmt(f),
            Self::Machine => {
                f.write_str("the device's own arms or sensor failed: its log says how")
            }
            Self::Protocol { device, host } => write!(
                f,
                "the device speaks version {device} of the protocol, the host version {host}"
            ),
            Self::Refused(refusal) => write!(f, "the host refused: {refusal}"),
            Self::NoReply => f.write_str("the host does not reply"),
            Self::Diverged => {
                f.write_str("the fit diverged: no material that the recipe knows measures so")
            }
        }
    }
}

impl core::error::Error for Failure {}
