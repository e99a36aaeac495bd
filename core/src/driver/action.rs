//! What a driver says.

use crate::geometry::Directions;
use crate::heapless::Vec;
use crate::link::{BYTES_PER_FRAME, Failure};
use crate::scan::{Reading, Residual};

/// What a firmware has to do next.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Nothing, until a byte comes, one can be sent, or so many milliseconds have passed.
    Wait {
        /// Milliseconds; `u32::MAX` if only [`Driver::restart`](crate::driver::Driver::restart)
        /// will change anything.
        milliseconds: u32,
    },
    /// Nothing but to call again soon: a slice of the fit was done, or a reply was heard.
    Continue,
    /// Move the arms and read the sensor there, then
    /// [`Driver::record`](crate::driver::Driver::record) (or
    /// [`Driver::fail`](crate::driver::Driver::fail)). This sample is the first in the pattern's
    /// order; any other of [`Scan::pending`](crate::scan::Scan::pending) will do. The same is said
    /// until a reading was recorded.
    Measure {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// Where the light and the sensor have to be.
        directions: Directions<f32>,
    },
    /// Keep this reading where a reset leaves it.
    Save {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// What the sensor saw.
        reading: Reading,
    },
    /// Forget all readings that were kept.
    Forget,
    /// Write these bytes of a new recipe where the present one is not.
    Store {
        /// Where they begin. At 0 another recipe begins.
        offset: u32,
        /// The bytes.
        bytes: Vec<u8, BYTES_PER_FRAME>,
    },
    /// All bytes of the new recipe are stored. Parse them; if they are a whole recipe, use it from
    /// now on, with a new scan and driver; else [`Driver::fail`](crate::driver::Driver::fail), and
    /// this one is not fetched again.
    Install {
        /// How many bytes there are.
        bytes: u32,
        /// The checksum that its header should have.
        checksum: u32,
    },
    /// The scan is done: [`Scan::fitted`](crate::scan::Scan::fitted) has the material until the
    /// next call. With [`Host::Measures`](crate::driver::Host::Measures) the next scan begins by
    /// itself, else by [`Driver::restart`](crate::driver::Driver::restart).
    Finished(Residual),
    /// The scan is given up. It begins anew by itself where a host measures or listens, else by
    /// [`Driver::restart`](crate::driver::Driver::restart).
    Failed(Failure),
}
