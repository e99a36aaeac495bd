//! The firmware around a scan.

use glimpse_core::scan::Residual;

use super::{Command, News};
use crate::station::ARMS;

/// The firmware around a scan. None of its functions may wait.
pub trait Platform {
    /// Microseconds since the last call. It comes in every round: the place to feed a watchdog.
    fn elapsed(&mut self) -> u32;

    /// A byte from a host, if one has come.
    fn receive(&mut self) -> Option<u8>;

    /// Sends a byte; false if the one before is still on its way.
    fn send(&mut self, byte: u8) -> bool;

    /// A command, if somebody has just given one; see [`Button`](super::Button). It comes in every
    /// round.
    fn command(&mut self) -> Option<Command>;

    /// Counts of the arms' steps, to be left where a reset does not touch them.
    fn remember(&mut self, positions: Option<[i32; ARMS]>);

    /// Reports an event.
    fn tell(&mut self, news: News);

    /// The material was fitted.
    fn finished(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>);
}
