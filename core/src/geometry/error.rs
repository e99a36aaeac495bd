//! Errors of a pair of directions.

use serde::{Deserialize, Serialize};

/// The largest deviation of a direction's length from 1. It admits directions from tables with three decimals.
pub const UNIT_TOLERANCE: f32 = 1e-3;

/// One of the two arms of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Arm {
    /// The arm with the light, at the incoming direction.
    Light,
    /// The arm with the sensor, at the outgoing direction.
    Sensor,
}

impl core::fmt::Display for Arm {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Light => "light",
            Self::Sensor => "sensor",
        })
    }
}

/// A reason why a pair of directions has no BRDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DirectionsError {
    /// A direction holds a NaN or an infinity.
    NonFinite(Arm),
    /// A direction's length is not 1.
    NotUnit(Arm),
    /// A direction is at or below the horizon.
    BelowHorizon(Arm),
}

impl core::fmt::Display for DirectionsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite(arm) => write!(
                f,
                "the direction towards the {arm} holds a NaN or an infinity"
            ),
            Self::NotUnit(arm) => write!(
                f,
                "the direction towards the {arm} is not a unit vector: divide it by its length, which has to be 1 within 0.001"
            ),
            Self::BelowHorizon(arm) => write!(
                f,
                "the {arm} is at or below the horizon: z has to be positive, along the sample's normal"
            ),
        }
    }
}

impl core::error::Error for DirectionsError {}
