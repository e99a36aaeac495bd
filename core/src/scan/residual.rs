//! How well a fit explains its readings.

use serde::{Deserialize, Serialize};

/// How well a fit explains its readings.
///
/// It cannot see a wrong convention: readings that are times the cosine are fitted as well as
/// others. [`gonio`](crate::gonio)'s test on a tile of known reflectance can.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Residual {
    /// The mean cosine-weighted logarithmic error over the readings.
    pub mean: f32,
    /// The reading that is explained worst.
    pub worst_index: u16,
    /// Its error.
    pub worst: f32,
    /// How many readings were saturated.
    pub saturated: u16,
    /// How many readings were the one before them in the pattern, bit for bit. A real sensor is too
    /// noisy for that; if all but the first were, it is stuck.
    pub repeated: u16,
    /// How many readings were too far below 0 for the loss, and were brought up to what it takes.
    pub clamped: u16,
}
