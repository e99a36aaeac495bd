//! Actions that the firmware carries out for a driver.

#[cfg(doc)]
use super::{Driver, Host};
use crate::geometry::Directions;
use crate::link::{Failure, RecipeBytes};
#[cfg(doc)]
use crate::scan::Scan;
use crate::scan::{Reading, Residual};

/// The next action of the firmware. Ignore unknown actions.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Action {
    /// Sleep until a byte arrives or can be sent, or [`Driver::poll_delay`] has passed.
    Wait,
    /// Poll again soon: the driver did a slice of a fit, or handled a reply.
    Continue,
    /// Move the arms, read the sensor, and call [`Driver::record`]. If only this sample cannot be read, call
    /// [`Driver::skip`]. If arms or sensor failed, or the recipe needs every reading, call [`Driver::fail`]. The driver
    /// repeats this action until one of these calls.
    ///
    /// The sample is the first pending one in the pattern's order. The firmware may read any other of [`Scan::pending`]
    /// instead.
    Measure {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Directions of light and sensor.
        directions: Directions<f32>,
    },
    /// Save this reading in memory that survives a reset.
    Save {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// Delete all saved readings.
    Forget,
    /// Write these bytes of a new recipe, without overwriting the current one.
    Store {
        /// Position of the bytes in the recipe. Position 0 starts another recipe.
        offset: u32,
        /// The bytes.
        bytes: RecipeBytes,
    },
    /// The new recipe is stored. Parse it. If it is valid, use it from now on with a new scan and a new driver.
    /// Otherwise call [`Driver::fail`], and the driver does not fetch it again.
    Install {
        /// Length of the recipe in bytes.
        bytes: u32,
        /// The checksum that its header should have.
        checksum: u32,
    },
    /// The scan is finished. The fit may be implausible: check [`Residual::implausible`] first. [`Scan::fitted`] has
    /// the material until the next poll.
    ///
    /// The next poll returns [`Action::Forget`], even after a restart. Carry it out before you stop; otherwise the next
    /// boot continues with these readings. With [`Host::Measures`], the next scan begins automatically. Otherwise call
    /// [`Driver::restart`].
    Finished(Residual),
    /// The scan has failed. With a host, it begins again automatically after a pause. Otherwise call
    /// [`Driver::restart`].
    Failed(Failure),
}
