//! Where in a scan a driver is.

use crate::link::Failure;

/// Where in a scan a driver is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    /// A host is greeted.
    Greet,
    /// It is asked for another recipe.
    Update,
    /// That recipe is fetched, and stored.
    Store {
        offset: u32,
        bytes: u32,
        checksum: u32,
    },
    /// All of it is stored.
    Stored { bytes: u32, checksum: u32 },
    /// Readings that outlasted a reset are offered, from this index on.
    Offer { next: u16 },
    /// Readings are taken.
    Measure,
    /// The fit is under way.
    Fit,
    /// The fit is done. The reply to its last progress is none to values.
    Fitted,
    /// Values are told, from this one on; after the last, the end.
    Tell { offset: u16 },
    /// The scan is over.
    End,
    /// The host is told what failed.
    Complain(Failure),
    /// Nothing is done for so many milliseconds.
    Pause { left: u32 },
    /// Nothing is done until somebody says so.
    Rest,
}
