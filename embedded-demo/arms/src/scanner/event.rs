//! Events of a scan, and their log.

use glimpse_core::scan::{Reading, ReadingError};

use super::Outcome;
use crate::goniometer::LostSteps;
use crate::sensor::SensorError;
use crate::store::recipes::ReplaceError;

/// An event of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A scan has ended.
    Ended(Outcome),
    /// A recipe from a host was installed, or rejected.
    RecipeUpdate(Result<(), ReplaceError>),
    /// Readings of an interrupted scan are saved. The arms do not move before a [`Command`](super::Command).
    Saved {
        /// Number of saved readings.
        readings: u16,
    },
    /// A scan continues with its saved readings.
    Resumed,
    /// The command to continue is ignored, because no readings are saved.
    NothingSaved,
    /// The arms are home and have not lost any steps.
    Home {
        /// Number of readings that this confirms.
        confirmed: u16,
    },
    /// The arms have lost steps. The samples since the last homing are read again.
    LostSteps(LostSteps),
    /// A sample was read, and the reading is saved.
    Read {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The reading.
        reading: Reading,
    },
    /// A reading is invalid. The scan makes up to three attempts to read a sample.
    InvalidReading {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The error of the reading.
        error: ReadingError,
    },
    /// The sensor could not be read. The scan makes up to three attempts to read a sample.
    ReadFailed {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The error of the sensor.
        error: SensorError,
    },
    /// A sample was skipped after three failed attempts. The scan continues without it.
    Skipped {
        /// Index of the sample in the recipe's pattern.
        index: u16,
    },
}

#[cfg(feature = "defmt")]
impl Event {
    /// Logs the event. Floating-point numbers are logged as their bits.
    pub fn log(&self) {
        match self {
            Self::Ended(Outcome::Finished) => defmt::info!("finished"),
            Self::Ended(Outcome::NotStarted) => {}
            Self::Ended(Outcome::NoHost) => defmt::info!("no host replies"),
            Self::Ended(Outcome::HostLost { started: true }) => {
                defmt::warn!("the host stopped replying: the scan continues without it");
            }
            Self::Ended(Outcome::HostLost { started: false }) => {
                defmt::warn!("the host stopped replying");
            }
            Self::Ended(Outcome::RecipeStored { bytes, .. }) => {
                defmt::info!("received a recipe of {=u32} bytes", bytes);
            }
            Self::Ended(Outcome::Failed(error)) => defmt::error!("failed: {}", error),
            Self::RecipeUpdate(Ok(())) => defmt::info!("a new recipe is active"),
            Self::RecipeUpdate(Err(error)) => {
                defmt::error!("the new recipe was rejected: {}", error);
            }
            Self::Saved { readings } => defmt::info!(
                "saved readings: {=u16}; press briefly for a new material, or for two seconds to continue",
                readings
            ),
            Self::NothingSaved => {
                defmt::warn!("no saved readings to continue: press briefly for a new scan");
            }
            Self::Resumed => defmt::info!("scan resumed"),
            Self::Home { confirmed } => defmt::info!("home: {=u16} readings confirmed", confirmed),
            Self::LostSteps(LostSteps { arm, steps }) => {
                defmt::warn!("lost steps: arm {=u8}, {=i32} steps", arm, steps);
            }
            Self::Read { index, reading } => {
                let [red, green, blue] = reading.brdf.map(f32::to_bits);
                defmt::info!(
                    "reading {=u16}: {=u32:08x} {=u32:08x} {=u32:08x} {=bool}",
                    index,
                    red,
                    green,
                    blue,
                    reading.saturated
                );
            }
            Self::InvalidReading { index, error } => {
                defmt::warn!("invalid reading of sample {=u16}: {}", index, error);
            }
            Self::ReadFailed { index, error } => {
                defmt::warn!("sample {=u16} could not be read: {}", index, error);
            }
            Self::Skipped { index } => {
                defmt::warn!("sample {=u16} is skipped after failed attempts", index);
            }
        }
    }
}

/// Logs fitted values as little-endian bytes, eight values per line.
#[cfg(feature = "defmt")]
pub fn log_values(values: &mut dyn Iterator<Item = f32>) {
    let mut line = [0; 32];
    let mut first = 0_u16;
    loop {
        let mut count = 0_usize;
        for (bytes, value) in line.chunks_exact_mut(4).zip(&mut *values) {
            bytes.copy_from_slice(&value.to_le_bytes());
            count = count.saturating_add(4);
        }
        let Some(bytes @ [_, ..]) = line.get(..count) else {
            return;
        };
        defmt::info!("values {=u16}: {=[u8]:02x}", first, bytes);
        first = first.saturating_add(8);
    }
}
