//! The person at the scanner.

use glimpse_core::error::Error;
use glimpse_core::scan::Residual;

/// A command of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Stop the arms at once. The scan fails, and keeps its readings.
    Stop,
    /// After a failure: home the arms and continue the scan.
    Resume,
    /// Scan the next material.
    Restart,
}

/// An event of a scan, for the operator.
pub enum Event<'v> {
    /// The scan is complete: its residual, and the fitted values in the order of the model.
    Finished(Residual, &'v mut dyn Iterator<Item = f32>),
    /// Nothing moves until a command.
    Failed(Error),
    /// A reading is not saved, and lost in a reset.
    Unsaved,
}

/// Buttons and a display, or commands over a network.
pub trait Operator {
    /// Waits for a command. The future may be dropped at any time, and must not lose a command then.
    async fn command(&mut self) -> Command;

    /// Shows an event.
    fn show(&mut self, event: Event<'_>);
}
