//! Commands of the person at the scanner, and the button that gives them.

/// A command of the person at the scanner. Nothing moves before one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Scan a new material: saved readings are forgotten.
    NewScan,
    /// Continue the scan whose readings are saved.
    Continue,
}

/// Microseconds for which the contact has to read the same.
const DEBOUNCE: u32 = 20_000;
/// Microseconds that one call counts for at most: a late caller has to read the contact as often.
const MAX_ELAPSED: u32 = 10_000;
/// Microseconds after which a press is a long one.
const LONG: u32 = 2_000_000;

/// A button: a short press is [`Command::NewScan`] on release, a press of two seconds is
/// [`Command::Continue`].
///
/// A button that is pressed from the start is ignored until it is released: somebody leans on it, or
/// its wires touch each other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Button {
    /// The contact's last state, and the microseconds since it changed.
    level: bool,
    stable: u32,
    /// The debounced state.
    is_pressed: bool,
    /// Microseconds since it was pressed; None if this press does not count.
    held: Option<u32>,
    /// The button was seen released.
    was_released: bool,
}

impl Button {
    /// Takes the contact's state, `elapsed` microseconds after the last call.
    pub fn poll(&mut self, contact: bool, elapsed: u32) -> Option<Command> {
        let elapsed = elapsed.min(MAX_ELAPSED);
        if contact == self.level {
            self.stable = self.stable.saturating_add(elapsed);
        } else {
            self.level = contact;
            self.stable = 0;
        }
        self.held = self.held.map(|held| held.saturating_add(elapsed));
        if self.stable >= DEBOUNCE && !contact {
            self.was_released = true;
        }
        if self.stable >= DEBOUNCE && contact != self.is_pressed {
            self.is_pressed = contact;
            if contact {
                self.held = self.was_released.then_some(self.stable);
            } else {
                return self.held.take().map(|_| Command::NewScan);
            }
        }
        if self.is_pressed && self.held? >= LONG {
            self.held = None;
            return Some(Command::Continue);
        }
        None
    }
}
