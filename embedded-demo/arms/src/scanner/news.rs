//! Events of a scan.

use glimpse_core::scan::{Reading, ReadingError};

use super::End;
use crate::goniometer::LostSteps;
use crate::sensor::SensorError;
use crate::store::recipes::ReplaceError;

/// An event of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// A scan has ended.
    End(End),
    /// Another recipe was put in force, or why it was not.
    Recipe(Result<(), ReplaceError>),
    /// Readings of a scan that has not ended are saved. Nothing moves before a
    /// [`Command`](super::Command).
    Saved {
        /// Their number.
        readings: u16,
    },
    /// A scan goes on with its saved readings.
    GoesOn,
    /// There are no saved readings to continue with.
    NothingSaved,
    /// The arms are home and have lost no step.
    Home {
        /// Readings that the scan takes for good now.
        confirmed: u16,
    },
    /// The arms have lost steps: what was read since they were home is read again.
    LostSteps(LostSteps),
    /// A sample was read, and the reading is kept.
    Read {
        /// Its index in the recipe's pattern.
        index: u16,
        /// What the sensor saw.
        reading: Reading,
    },
    /// What was read cannot be a reading: it is read again, up to three times.
    Refused {
        /// Its index in the recipe's pattern.
        index: u16,
        /// What is wrong with it.
        error: ReadingError,
    },
    /// The sensor could not be read: it is read again, up to three times.
    Unread {
        /// Index of the sample in the recipe's pattern.
        index: u16,
        /// The sensor's error.
        error: SensorError,
    },
    /// A sample could not be read three times. The scan continues without it.
    Skipped {
        /// Its index in the recipe's pattern.
        index: u16,
    },
}

#[cfg(feature = "defmt")]
impl News {
    /// Logs it, numbers as their bits.
    pub fn log(&self) {
        match self {
            Self::End(End::Finished) => defmt::info!("finished"),
            Self::End(End::Waiting) => {}
            Self::End(End::Alone) => defmt::info!("no host listens"),
            Self::End(End::Silent { started: true }) => {
                defmt::warn!("the host fell silent: the scan goes on without");
            }
            Self::End(End::Silent { started: false }) => defmt::warn!("the host fell silent"),
            Self::End(End::Stored { bytes, .. }) => {
                defmt::info!("a recipe of {=u32} bytes has come", bytes);
            }
            Self::End(End::Failed(error)) => defmt::error!("failed: {}", error),
            Self::Recipe(Ok(())) => defmt::info!("a new recipe is in force"),
            Self::Recipe(Err(error)) => defmt::error!("the old recipe stays: {}", error),
            Self::Saved { readings } => defmt::info!(
                "saved readings: {=u16}; press shortly for a new material, or for two seconds to continue",
                readings
            ),
            Self::NothingSaved => defmt::warn!("nothing to continue: press shortly for a new scan"),
            Self::GoesOn => defmt::info!("goes on"),
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
            Self::Refused { index, error } => {
                defmt::warn!("refused reading {=u16}: {}", index, error);
            }
            Self::Unread { index, error } => {
                defmt::warn!("sample {=u16} is not read: {}", index, error);
            }
            Self::Skipped { index } => {
                defmt::warn!("sample {=u16} cannot be read and is skipped", index);
            }
        }
    }
}

/// Logs fitted values, eight in a line, as the little-endian bytes of each.
#[cfg(feature = "defmt")]
pub fn log_values(values: &mut dyn Iterator<Item = f32>) {
    let mut line = [0; 32];
    let mut first = 0_u16;
    loop {
        let mut count = 0_usize;
        for (place, value) in line.chunks_exact_mut(4).zip(&mut *values) {
            place.copy_from_slice(&value.to_le_bytes());
            count = count.saturating_add(4);
        }
        let Some(bytes @ [_, ..]) = line.get(..count) else {
            return;
        };
        defmt::info!("values {=u16}: {=[u8]:02x}", first, bytes);
        first = first.saturating_add(8);
    }
}
