//! A normally closed switch with a debounced contact.

use embedded_hal::digital::InputPin;

use super::AxisError;

/// Microseconds for which a contact has to read the same. Contacts of microswitches bounce for less.
const DEBOUNCE: u32 = 5_000;
/// Microseconds that one poll counts for at most: a late caller has to read the contact as often.
const MAX_ELAPSED: u32 = 1_000;
/// Microseconds after which a contact that still bounces is broken.
const MAX_BOUNCING: u32 = 100_000;

/// A switch whose pin is pulled up, and low while the switch is closed. The arm opens it at the end
/// of its travel; a broken wire reads the same.
#[derive(Debug)]
pub(super) struct Switch<H> {
    pin: H,
    level: Option<bool>,
    /// Microseconds since the level changed.
    stable: u32,
    /// Microseconds since the contact was stable.
    bouncing: u32,
}

impl<H: InputPin> Switch<H> {
    pub(super) fn new(pin: H) -> Self {
        Self {
            pin,
            level: None,
            stable: 0,
            bouncing: 0,
        }
    }

    /// Forgets what was read: a motion begins with a stable contact.
    pub(super) fn restart(&mut self) {
        self.level = None;
        self.bouncing = 0;
    }

    /// Reads the contact, `elapsed` microseconds after the last call. Returns true if it is open,
    /// and None while it bounces.
    pub(super) fn poll(&mut self, elapsed: u32) -> Result<Option<bool>, AxisError> {
        let elapsed = elapsed.min(MAX_ELAPSED);
        let is_open = self.pin.is_high().map_err(|_| AxisError::Pin)?;
        if self.level == Some(is_open) {
            self.stable = self.stable.saturating_add(elapsed);
        } else {
            self.level = Some(is_open);
            self.stable = 0;
        }
        if self.stable >= DEBOUNCE {
            self.bouncing = 0;
            return Ok(self.level);
        }
        self.bouncing = self.bouncing.saturating_add(elapsed);
        if self.bouncing >= MAX_BOUNCING {
            return Err(AxisError::SwitchBounces);
        }
        Ok(None)
    }
}
