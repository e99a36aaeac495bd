//! Actions that the firmware carries out for a driver.

#[cfg(doc)]
use super::{Driver, Host};
use crate::error::Error;
use crate::geometry::Directions;
use crate::gonio::Reading;
use crate::link::Purpose;
use crate::scan::Residual;

/// The next action of the firmware. All but [`Action::Measure`] and [`Action::Wait`] are returned once. Ignore unknown
/// actions.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Action {
    /// Sleep until a byte arrives or can be sent, or [`Driver::poll_delay`] has passed.
    Wait,
    /// Poll again soon: the driver did a slice of a fit, or handled a reply.
    Continue,
    /// Move the arms, read the sensor, and call [`Driver::record`]. If only this sample cannot be read, call
    /// [`Driver::skip`]. If arms or sensor failed, call [`Driver::fail`]. The driver repeats this action until one of
    /// these calls.
    ///
    /// Of [`Purpose::Sample`], the sample is the first pending one in the pattern's order. The firmware may read any other
    /// of [`Scan::pending`](crate::scan::Scan::pending) instead.
    Measure {
        /// The purpose. Switch the lamp off for [`Purpose::Dark`].
        purpose: Purpose,
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Directions of light and sensor.
        directions: Directions<f32>,
    },
    /// Save this reading in memory that survives a reset. [`Store::save`](crate::store::Store::save) does this.
    Save {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading; None if the sample was skipped.
        reading: Option<Reading>,
    },
    /// Delete all saved readings. If this fails, try again before the next scan: a reset would restore them.
    Forget,
    /// The fit is complete. It may be implausible: check [`Residual::implausible`] first.
    /// [`Scan::fitted`](crate::scan::Scan::fitted) has the material until the next scan.
    ///
    /// The driver then sends the result to the host, and returns [`Action::Forget`] when the host has accepted it. After a
    /// reset before that, restored readings are fitted again, without a move. With [`Host::Measures`], the next scan
    /// begins afterwards. Otherwise call [`Driver::restart`].
    Finished(Residual),
    /// The scan has failed, or its result was refused. The readings are kept, and nothing moves until
    /// [`Driver::resume`] or [`Driver::restart`].
    Failed(Error),
}
