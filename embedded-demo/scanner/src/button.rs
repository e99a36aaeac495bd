//! A debounced button.

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Timer};
use embedded_hal::digital::InputPin;
use embedded_hal_async::digital::Wait;

/// The time for which a contact bounces, at most.
const BOUNCE: Duration = Duration::from_millis(20);
/// The time after which a press is a hold.
const HOLD: Duration = Duration::from_secs(2);

/// A change of a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Press {
    /// It is pressed.
    Down,
    /// It is pressed for 2 s.
    Held,
    /// It is released before that.
    Up,
}

/// A button that connects its pin to ground.
#[derive(Debug)]
pub struct Button<P> {
    pin: P,
    /// True if the next change is a press.
    is_released: bool,
    /// The time of a change that may be a bounce.
    changed: Option<Instant>,
    /// The end of a hold that has begun.
    held_at: Option<Instant>,
}

impl<P: Wait + InputPin> Button<P> {
    /// Creates a button. A press counts after the first release.
    pub fn new(pin: P) -> Self {
        Self {
            pin,
            is_released: false,
            changed: None,
            held_at: None,
        }
    }

    /// Waits for a change. The future may be dropped; the next one continues. A pin that cannot be read is never pressed.
    pub async fn press(&mut self) -> Press {
        loop {
            let Some(changed) = self.changed else {
                if self.wait_for_change().await {
                    self.held_at = None;
                    return Press::Held;
                }
                self.changed = Some(Instant::now());
                continue;
            };
            // A new timer is not ready at its first poll, so a line that is always ready would starve it.
            if Instant::now() < changed + BOUNCE {
                Timer::at(changed + BOUNCE).await;
            }
            self.changed = None;
            let is_low = self.pin.is_low();
            if is_low.is_ok_and(|is_low| is_low == self.is_released) {
                self.is_released = !self.is_released;
                if !self.is_released {
                    self.held_at = Some(changed + HOLD);
                    return Press::Down;
                }
                if self.held_at.take().is_some() {
                    return Press::Up;
                }
            }
        }
    }

    /// Waits for a change of the pin. Returns true if the button is held before.
    async fn wait_for_change(&mut self) -> bool {
        if self.held_at.is_some_and(|at| at <= Instant::now()) {
            return true;
        }
        let is_released = self.is_released;
        let change = async {
            let changed = match is_released {
                true => self.pin.wait_for_low().await,
                false => self.pin.wait_for_high().await,
            };
            if changed.is_err() {
                core::future::pending::<()>().await;
            }
        };
        let hold = Timer::at(self.held_at.unwrap_or(Instant::MAX));
        matches!(select(change, hold).await, Either::Second(()))
    }
}
