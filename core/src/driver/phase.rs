//! Phases of a scan.

use crate::link::Failure;

/// Phase of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Phase {
    /// Sends `Hello` to the host.
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
    /// Offers readings from before a reset to the host, from index `next` on.
    Offer { next: u16 },
    /// Reads, fits, or sends the values, depending on the scan's state.
    Scan,
    /// The scan is finished.
    End,
    /// Reports a failure to the host.
    ReportFailure(Failure),
    /// Waits after a failure, until a time in ms.
    Pause { until: u64 },
    /// Waits for a restart.
    Rest,
}
