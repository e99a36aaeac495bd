//! A panel with one button and one light.

use embassy_futures::select::{Either, select};
use embassy_time::{Instant, Timer};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::digital::Wait;
use glimpse_core::error::ErrorCode;

use crate::button::{Button, Press};
use crate::operator::{Command, Event, Operator, State};

/// A button, and a light whose pin is high while it is on.
#[derive(Debug)]
pub struct Panel<B, L> {
    button: Button<B>,
    light: L,
    state: State,
    /// The commands of a press and of a hold.
    commands: [Command; 2],
    /// The last command.
    last: Command,
}

impl<B: Wait + InputPin, L: OutputPin> Panel<B, L> {
    /// Creates a panel.
    pub fn new(button: B, light: L) -> Self {
        Self {
            button: Button::new(button),
            light,
            state: State::Waits,
            commands: [Command::Resume, Command::Calibrate],
            last: Command::Resume,
        }
    }

    /// Waits for a press, and blinks.
    async fn press(&mut self) -> Press {
        loop {
            let (is_on, ms) = blink(self.state, Instant::now().as_millis());
            _ = self.light.set_state(is_on.into()); // a panel without a light works
            let timer = Timer::after_millis(ms);
            if let Either::First(press) = select(self.button.press(), timer).await {
                return press;
            }
        }
    }
}

/// Returns true if the light is on at a time, and the time until that changes, ms.
fn blink(state: State, now: u64) -> (bool, u64) {
    let (on, off) = match state {
        State::Waits => (500, 500),
        State::Moves => (1000, 0),
        State::Finished => (50, 1950),
        State::Failed => (100, 100),
    };
    let phase = now % (on + off);
    match phase < on {
        true => (true, on - phase),
        false => (false, on + off - phase),
    }
}

impl<B: Wait + InputPin, L: OutputPin> Operator for Panel<B, L> {
    async fn command(&mut self) -> Command {
        let [pressed, held] = self.commands;
        self.last = loop {
            match (self.press().await, self.state) {
                // At once, not when the button is released.
                (Press::Down, State::Moves) => return Command::Stop,
                (_, State::Moves) | (Press::Down, _) => {}
                (Press::Up, _) => break pressed,
                (Press::Held, _) => break held,
            }
        };
        self.last
    }

    fn show(&mut self, event: &mut Event<'_>) {
        self.state = event.state();
        self.commands = match event {
            Event::Saved => [Command::Resume, Command::Restart],
            Event::Finished(..) => [Command::Restart, Command::Calibrate],
            // A calibration that has failed begins again.
            Event::Failed(_) if self.last == Command::Calibrate => [Command::Calibrate; 2],
            Event::Failed(error) if error.code != ErrorCode::NotCalibrated => {
                [Command::Resume, Command::Restart]
            }
            _ => [Command::Resume, Command::Calibrate],
        };
    }
}
