//! Simulated pins.

use embassy_time::Timer;
use embedded_hal::digital::{ErrorKind, ErrorType, InputPin, OutputPin};
use embedded_hal_async::digital::Wait;

/// A pin of a function: an output calls it with each level, and an input with each read.
pub struct Pin<F>(pub F);

/// An output in a type with a name.
pub type Output<'a> = Pin<Box<dyn FnMut(bool) + 'a>>;
/// An input in a type with a name.
pub type Input<'a> = Pin<Box<dyn FnMut() -> Result<bool, ErrorKind> + 'a>>;

impl<F> ErrorType for Pin<F> {
    type Error = ErrorKind;
}

impl<F: FnMut(bool)> OutputPin for Pin<F> {
    fn set_low(&mut self) -> Result<(), ErrorKind> {
        self.0(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), ErrorKind> {
        self.0(true);
        Ok(())
    }
}

impl<F: FnMut() -> Result<bool, ErrorKind>> InputPin for Pin<F> {
    fn is_high(&mut self) -> Result<bool, ErrorKind> {
        self.0()
    }

    fn is_low(&mut self) -> Result<bool, ErrorKind> {
        self.0().map(|is_high| !is_high)
    }
}

impl<F: FnMut() -> Result<bool, ErrorKind>> Wait for Pin<F> {
    async fn wait_for_high(&mut self) -> Result<(), ErrorKind> {
        while self.is_low()? {
            Timer::after_millis(1).await;
        }
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), ErrorKind> {
        while self.is_high()? {
            Timer::after_millis(1).await;
        }
        Ok(())
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), ErrorKind> {
        self.wait_for_low().await?;
        self.wait_for_high().await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), ErrorKind> {
        self.wait_for_high().await?;
        self.wait_for_low().await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), ErrorKind> {
        match self.is_high()? {
            true => self.wait_for_low().await,
            false => self.wait_for_high().await,
        }
    }
}
