//! Phases of a driver.

use crate::error::Error;

/// Phase of a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Phase {
    /// Sends `Hello` to the host, after the pause.
    Hello,
    /// Requests another recipe from the host.
    Update,
    /// Fetches and stores that recipe.
    Store {
        offset: u32,
        bytes: u32,
        checksum: u32,
    },
    /// All of that recipe is stored.
    Stored { bytes: u32, checksum: u32 },
    /// The firmware was asked to install that recipe.
    Installed,
    /// Offers recorded readings to the host, from index `next` on.
    Offer { next: u16 },
    /// Reads, fits, or sends the result, depending on the scan's state. This is the only phase in which arms move.
    Scan,
    /// The host has the result.
    Published,
    /// Reports a failure to the host.
    ReportFailure(Error),
    /// Waits for a call of the firmware.
    Rest,
}
