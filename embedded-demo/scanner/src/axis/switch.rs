//! A normally closed switch with a debounced contact.

use embedded_hal::digital::InputPin;
use glimpse_core::error::{Error, ErrorCode};

/// Time for which the contact must be stable, us. Contacts of microswitches bounce for less.
const DEBOUNCE_US: u32 = 5_000;
/// Maximum time that one poll counts, us. A late caller has to read the contact as often as others.
const MAX_ELAPSED_US: u32 = 1_000;
/// Time after which a bouncing contact is an error, us.
const MAX_BOUNCE_US: u32 = 100_000;

/// A switch with a pull-up: the pin is low while the switch is closed. The arm opens it at the end of its travel. A
/// broken wire reads as open.
#[derive(Debug)]
pub(super) struct Switch<H> {
    pin: H,
    level: Option<bool>,
    /// Time since the level changed, us.
    stable: u32,
    /// Time since the contact was stable, us.
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

    /// Discards the state: a motion begins with a stable contact.
    pub(super) fn restart(&mut self) {
        (self.level, self.bouncing) = (None, 0);
    }

    /// Reads the contact. `elapsed_us` is the time since the last call. Returns true if the contact is open, and None
    /// while it bounces.
    pub(super) fn poll(&mut self, elapsed_us: u32) -> Result<Option<bool>, Error> {
        let elapsed_us = elapsed_us.min(MAX_ELAPSED_US);
        let is_open = self.pin.is_high().map_err(|_| Error::new(ErrorCode::Pin))?;
        self.stable = match self.level.replace(is_open) == Some(is_open) {
            true => self.stable.saturating_add(elapsed_us),
            false => 0,
        };
        if self.stable >= DEBOUNCE_US {
            self.bouncing = 0;
            return Ok(self.level);
        }
        self.bouncing = self.bouncing.saturating_add(elapsed_us);
        if self.bouncing >= MAX_BOUNCE_US {
            return Err(Error::new(ErrorCode::SwitchBounces));
        }
        Ok(None)
    }
}
