//! Actions that a driver asks for.

#[cfg(doc)]
use super::{Driver, Host};
use crate::geometry::Directions;
use crate::link::{Failure, RecipeBytes};
#[cfg(doc)]
use crate::scan::Scan;
use crate::scan::{Reading, Residual};

/// The next action of a firmware. Ignore actions that the firmware does not know.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Action {
    /// Sleep until a byte arrives or can be sent, or [`Driver::poll_delay`] has passed.
    Wait,
    /// Poll again soon: the driver did a slice of the fit, or handled a reply.
    Continue,
    /// Move the arms, read the sensor, then call [`Driver::record`]. If only this sample cannot be read, call
    /// [`Driver::skip`]; if arms or sensor failed, or the recipe needs every reading, [`Driver::fail`]. This
    /// sample is the first in the pattern's order; any other of [`Scan::pending`] is as good. The driver repeats
    /// this action until one of these calls.
    Measure {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Directions of light and sensor.
        directions: Directions<f32>,
    },
    /// Save this reading where it outlasts a reset.
    Save {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// Delete all saved readings.
    Forget,
    /// Write these bytes of a new recipe next to the present one.
    Store {
        /// Position of the bytes. At 0 another recipe begins.
        offset: u32,
        /// The bytes.
        bytes: RecipeBytes,
    },
    /// The new recipe is stored. Parse it. If it is valid, use it from now on with a new scan and a new driver; else
    /// call [`Driver::fail`], and the driver does not fetch it again.
    Install {
        /// Length of the recipe in bytes.
        bytes: u32,
        /// The checksum that its header should have.
        checksum: u32,
    },
    /// The scan is finished, also if the fit is implausible: check [`Residual::implausible`] first. [`Scan::fitted`] has
    /// the material until the next poll. That poll returns [`Action::Forget`], also after a restart: carry it out before
    /// you stop, or the next boot continues with these readings. With [`Host::Measures`] the next scan begins by itself,
    /// else with [`Driver::restart`].
    Finished(Residual),
    /// The scan has failed. With a host it begins again by itself after a pause, else with [`Driver::restart`].
    Failed(Failure),
}
