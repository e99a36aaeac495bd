//! What a scan asks of the firmware around it.

use glimpse_core::scan::Residual;

use super::News;
use crate::station::ARMS;

/// What a scan asks of the firmware around it. None of it may wait.
pub trait Platform {
    /// Microseconds since the last call. It comes in every round: the place to feed a watchdog.
    fn elapsed(&mut self) -> u32;

    /// A byte from a host, if one has come.
    fn receive(&mut self) -> Option<u8>;

    /// Sends a byte; false if the one before is still on its way.
    fn send(&mut self, byte: u8) -> bool;

    /// Whether the button is pressed.
    fn is_started(&mut self) -> bool;

    /// Counts of the arms' steps, to be left where a reset does not touch them.
    fn remember(&mut self, positions: Option<[i32; ARMS]>);

    /// What has happened.
    fn tell(&mut self, news: News);

    /// The material was fitted.
    fn finished(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>);
}
