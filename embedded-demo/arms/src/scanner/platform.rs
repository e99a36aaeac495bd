//! The interface between a scan and the firmware around it.

use glimpse_core::scan::Residual;

use super::{Command, Event};
use crate::station::ARMS;

/// The firmware around a scan. None of its functions may wait.
pub trait Platform {
    /// Returns the microseconds since the last call. It is called in every iteration of the main loop, so it can feed a
    /// watchdog.
    fn elapsed_us(&mut self) -> u32;

    /// Returns the next byte from a host, if one was received.
    fn receive(&mut self) -> Option<u8>;

    /// Sends a byte. Returns false if the transmitter is busy.
    fn send(&mut self, byte: u8) -> bool;

    /// Returns a command if one was given since the last call; see [`Button`](super::Button). It is called in every
    /// iteration.
    fn command(&mut self) -> Option<Command>;

    /// Saves the arms' step counts in memory that survives a reset. `positions` is None if they are unknown.
    fn save_positions(&mut self, positions: Option<[i32; ARMS]>);

    /// Reports an event.
    fn report(&mut self, event: Event);

    /// Reports the residual and the values of a fitted material.
    fn report_fit(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>);
}
