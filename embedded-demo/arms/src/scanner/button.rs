//! Commands of the user, and the button that gives them.

/// A command of the user. The arms do not move before the first command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Scan a new material. Saved readings are deleted.
    NewScan,
    /// Continue the interrupted scan with its saved readings.
    Continue,
}

/// Time for which the contact must be stable, us.
const DEBOUNCE_US: u32 = 20_000;
/// Maximum time that one call counts, us. A late caller has to read the contact as often as others.
const MAX_ELAPSED_US: u32 = 10_000;
/// Duration of a long press, us.
const LONG_PRESS_US: u32 = 2_000_000;

/// A debounced button. A short press is [`Command::NewScan`], on release. A press of two seconds is
/// [`Command::Continue`].
///
/// A button that is pressed at power-up is ignored until it is released: it may be blocked or short-circuited.
#[derive(Clone, Copy, Debug, Default)]
pub struct Button {
    /// Last state of the contact, and the time since it changed, us.
    level: bool,
    stable: u32,
    /// Debounced state.
    is_pressed: bool,
    /// Duration of the press, us. None if this press is ignored.
    held: Option<u32>,
    /// The button was released at least once.
    was_released: bool,
}

impl Button {
    /// Handles the state of the contact. `elapsed_us` is the time since the last call. Returns a command once per
    /// press.
    pub fn poll(&mut self, contact: bool, elapsed_us: u32) -> Option<Command> {
        let elapsed_us = elapsed_us.min(MAX_ELAPSED_US);
        if contact == self.level {
            self.stable = self.stable.saturating_add(elapsed_us);
        } else {
            self.level = contact;
            self.stable = 0;
        }
        self.held = self.held.map(|held| held.saturating_add(elapsed_us));
        if self.stable >= DEBOUNCE_US && !contact {
            self.was_released = true;
        }
        if self.stable >= DEBOUNCE_US && contact != self.is_pressed {
            self.is_pressed = contact;
            if contact {
                self.held = self.was_released.then_some(self.stable);
            } else {
                return self.held.take().map(|_| Command::NewScan);
            }
        }
        if self.is_pressed && self.held? >= LONG_PRESS_US {
            self.held = None;
            return Some(Command::Continue);
        }
        None
    }
}
