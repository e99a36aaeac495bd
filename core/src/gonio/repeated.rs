//! Mean and variance of repeated readings.

use crate::error::{Error, ErrorCode};

/// The mean and the variance of repeated readings of three channels, updated reading by reading (Welford 1962).
///
/// The readings may be counts or calibrated BRDFs. [`Calibration`](super::Calibration) is linear, so the BRDF of the
/// mean counts is the mean of the BRDFs. The variance of the mean is [`variance`](Self::variance) /
/// [`count`](Self::count).
///
/// ```
/// use glimpse_core::gonio::Repeated;
///
/// let mut counts = Repeated::default();
/// for reading in [[100.0, 80.0, 60.0], [104.0, 80.0, 63.0]] {
///     counts.add(reading, false)?;
/// }
/// assert_eq!(counts.mean(), Some([102.0, 80.0, 61.5]));
/// assert_eq!(counts.variance(), Some([8.0, 0.0, 4.5]));
/// # Ok::<(), glimpse_core::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Repeated {
    /// Number of readings.
    pub count: u32,
    /// The mean of each channel; 0 before any reading. If it is not finite, [`Repeated::add`] fails.
    pub mean: [f32; 3],
    /// Sums of squared distances from the mean. If they are not finite, [`Repeated::add`] fails.
    pub squares: [f32; 3],
    /// True if any reading was saturated. The mean is then too low.
    pub saturated: bool,
}

impl Repeated {
    /// Adds a reading.
    ///
    /// # Errors
    /// [`ErrorCode::ChannelNonFinite`] with the channel if it is NaN or infinite, or if its sums overflow. The statistics are then unchanged.
    pub fn add(&mut self, reading: [f32; 3], saturated: bool) -> Result<(), Error> {
        let mut next = *self;
        next.count = self.count.saturating_add(1);
        next.saturated |= saturated;
        let channels = next.mean.iter_mut().zip(&mut next.squares).zip(reading);
        for (channel, ((mean, squares), value)) in (0..).zip(channels) {
            let deviation = value - *mean;
            *mean += deviation / next.count as f32;
            *squares += deviation * (value - *mean);
            if !(mean.is_finite() && squares.is_finite()) {
                return Err(Error::with(ErrorCode::ChannelNonFinite, [channel, 0]));
            }
        }
        *self = next;
        Ok(())
    }

    /// The mean of each channel; None before any reading.
    #[must_use]
    pub fn mean(&self) -> Option<[f32; 3]> {
        (self.count > 0).then_some(self.mean)
    }

    /// The unbiased variance of a reading in each channel; None with fewer than two readings.
    #[must_use]
    pub fn variance(&self) -> Option<[f32; 3]> {
        let others = self.count.checked_sub(1).filter(|others| *others > 0)?;
        Some(self.squares.map(|squares| squares / others as f32))
    }
}
