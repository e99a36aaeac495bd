//! Pairs of directions.

use serde::{Deserialize, Serialize};

/// A pair of unit directions, pointing away from the surface; z is the normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Directions<T> {
    /// Towards the light, w_i.
    pub incoming: [T; 3],
    /// Towards the sensor, w_o.
    pub outgoing: [T; 3],
}
