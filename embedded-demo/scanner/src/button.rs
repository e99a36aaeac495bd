//! A debounced button.

use embassy_time::{Duration, Instant, Timer};
use embedded_hal::digital::InputPin;
use embedded_hal_async::digital::Wait;

/// The time for which a contact bounces, at most.
const BOUNCE: Duration = Duration::from_millis(20);

/// A button that connects its pin to ground.
#[derive(Debug)]
pub struct Button<P> {
    pin: P,
    /// True if the next change is a press.
    is_released: bool,
    /// The time of a change that may be a bounce.
    changed: Option<Instant>,
}

impl<P: Wait + InputPin> Button<P> {
    /// Creates a button. A press counts after the first release.
    pub fn new(pin: P) -> Self {
        Self {
            pin,
            is_released: false,
            changed: None,
        }
    }

    /// Waits for a press. The future may be dropped; the next one continues. A pin that cannot be read is never pressed.
    pub async fn pressed(&mut self) {
        loop {
            let Some(changed) = self.changed else {
                let wait = match self.is_released {
                    true => self.pin.wait_for_low().await,
                    false => self.pin.wait_for_high().await,
                };
                if wait.is_err() {
                    core::future::pending::<()>().await;
                }
                self.changed = Some(Instant::now());
                continue;
            };
            Timer::at(changed + BOUNCE).await;
            self.changed = None;
            let is_low = self.pin.is_low();
            if is_low.is_ok_and(|is_low| is_low == self.is_released) {
                self.is_released = !self.is_released;
                if !self.is_released {
                    return;
                }
            }
        }
    }
}
