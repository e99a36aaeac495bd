//! The person at the scanner.

use core::fmt;

use glimpse_core::error::Error;
use glimpse_core::scan::Residual;

use crate::optics::Counts;

/// A command of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Stop the arms at once. The scan fails, and keeps its readings.
    Stop,
    /// Go on: with a scan, after a failure, or after a question.
    Resume,
    /// Scan the next material.
    Restart,
    /// Calibrate with the white tile, which lies on the sample's place.
    Calibrate,
}

/// An event of a scan, for the operator. Its text is one line.
pub enum Event<'v> {
    /// Nothing moves until a command.
    Waiting,
    /// A complete scan from before a restart is saved: [`Command::Resume`] shows it, [`Command::Restart`] deletes it.
    Saved,
    /// The positions of the arms are unknown. [`Command::Resume`] homes them, if the lamp is nearer to the normal than the
    /// sensor.
    Question,
    /// The lamp cannot be switched. [`Command::Resume`] reads the dark, once it is covered.
    Cover,
    /// [`Command::Resume`] reads the white, once the lamp is uncovered.
    Uncover,
    /// The arms go home.
    Homing,
    /// A reading, its number and that of all, and its counts.
    Reading(u16, u16, Counts),
    /// The counts with the lamp off, or of the first sample again.
    Check(Counts),
    /// A reading is not saved, and lost in a restart.
    Unsaved,
    /// The scan is complete: its residual, and the fitted values in the order of the model.
    Finished(Residual, &'v mut dyn Iterator<Item = f32>),
    /// The white tile is read, and its counts are saved.
    Calibrated,
    /// Nothing moves until a command.
    Failed(Error),
}

/// The state of a scanner, for a lamp on its panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing moves until a command.
    Waits,
    /// The arms may move.
    Moves,
    /// A scan is complete.
    Finished,
    /// A scan has failed, or is complete with a warning.
    Failed,
}

impl Event<'_> {
    /// Returns the state after this event.
    pub fn state(&self) -> State {
        match self {
            Self::Waiting | Self::Saved | Self::Question | Self::Calibrated => State::Waits,
            Self::Cover | Self::Uncover => State::Waits,
            Self::Homing | Self::Reading(..) | Self::Check(_) | Self::Unsaved => State::Moves,
            Self::Finished(residual, _) if residual.implausible.is_none() => State::Finished,
            Self::Finished(..) | Self::Failed(_) => State::Failed,
        }
    }
}

impl fmt::Display for Event<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Waiting => f.write_str("waiting: press to scan, hold to calibrate"),
            Self::Saved => f.write_str("a complete scan is saved: press to show it, hold to delete it"),
            Self::Question => f.write_str(
                "the positions are unknown: turn the lamp nearer to the normal than the sensor, then press",
            ),
            Self::Cover => f.write_str("cover the lamp, then press"),
            Self::Uncover => f.write_str("uncover the lamp, then press"),
            Self::Homing => f.write_str("homing"),
            Self::Reading(number, of, counts) => write!(f, "reading {number} of {of}: {counts}"),
            Self::Check(counts) => write!(f, "check: {counts}"),
            Self::Unsaved => f.write_str("the last reading is not saved: check the flash"),
            Self::Finished(residual, _) => match residual.implausible {
                Some(code) => write!(f, "finished with a warning: {}", code.text()),
                None => f.write_str("finished"),
            },
            Self::Calibrated => f.write_str("calibrated: put a sample in, then press"),
            Self::Failed(error) => write!(f, "failed: {error}; press to go on"),
        }
    }
}

/// Buttons and a display, or commands over a network.
pub trait Operator {
    /// Waits for a command. The future may be dropped at any time, and must not lose a command then.
    async fn command(&mut self) -> Command;

    /// Shows an event.
    fn show(&mut self, event: &mut Event<'_>);
}
