//! A color sensor TCS3472 on an I2C bus, with a lens that sees the measured spot only.

use embassy_time::{Duration, Timer};
use embedded_hal_async::i2c::I2c;
use glimpse_core::error::{Error, ErrorCode};

use crate::optics::{Counts, Sensor};

const ADDRESS: u8 = 0x29;
/// The bit that marks a byte as a register's number; later bytes continue with the next registers.
const REGISTER: u8 = 0xA0;
const ENABLE: u8 = 0x00;
const INTEGRATION_TIME: u8 = 0x01;
const GAIN: u8 = 0x0F;
/// The register before those of clear, red, green and blue.
const STATUS: u8 = 0x13;
const POWER_ON: u8 = 1;
const CONVERT: u8 = 2;
/// The bit of [`STATUS`] that is set while there are valid counts.
const IS_VALID: u8 = 1;

/// An exposure: the gain's register, and the factor to the counts of the nominal one.
struct Exposure(u8, f32);

/// With the gain 1. Less time saturates at the same light.
const SHORT: Exposure = Exposure(0, 4.0);
/// With the gain 4.
const NOMINAL: Exposure = Exposure(1, 1.0);
/// With the gain 60.
const LONG: Exposure = Exposure(3, 1.0 / 15.0);
/// 64 cycles of 2.4 ms, the shortest time with counts up to 65,535.
const CYCLES: u8 = 64;
/// Counts at and above which a reading is saturated.
const SATURATION: f32 = 65_535.0;
/// Two integrations, because the first may have begun before the arms rest, and the start of the oscillator.
const SETTLE: Duration = Duration::from_millis(313);

/// A TCS3472: linear red, green and blue. A reading that saturates is read again with less exposure, and one below a
/// hundredth of the range with more.
#[derive(Debug)]
pub struct ColorSensor<B> {
    bus: B,
}

impl<B: I2c> ColorSensor<B> {
    /// Uses the sensor on a bus.
    pub fn new(bus: B) -> Self {
        Self { bus }
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), Error> {
        let written = self.bus.write(ADDRESS, &[REGISTER | register, value]).await;
        written.map_err(|_| FAULT)
    }

    /// Reads red, green and blue with an exposure. The settings are written each time: the sensor may have lost its power.
    async fn expose(&mut self, exposure: &Exposure) -> Result<[f32; 3], Error> {
        for (register, value) in [
            (ENABLE, POWER_ON),
            (INTEGRATION_TIME, CYCLES.wrapping_neg()),
            (GAIN, exposure.0),
            (ENABLE, POWER_ON | CONVERT),
        ] {
            self.write(register, value).await?;
        }
        Timer::after(SETTLE).await;
        let mut bytes = [0; 9];
        let read = self
            .bus
            .write_read(ADDRESS, &[REGISTER | STATUS], &mut bytes);
        read.await.map_err(|_| FAULT)?;
        let [status, _, _, r0, r1, g0, g1, b0, b1] = bytes;
        if status & IS_VALID == 0 {
            return Err(Error::new(ErrorCode::SensorReset));
        }
        Ok([[r0, r1], [g0, g1], [b0, b1]].map(|bytes| u16::from_le_bytes(bytes).into()))
    }
}

const FAULT: Error = Error::new(ErrorCode::Sensor);

impl<B: I2c> Sensor for ColorSensor<B> {
    async fn counts(&mut self, adapts: bool) -> Result<Counts, Error> {
        let mut exposure = NOMINAL;
        let mut counts = self.expose(&exposure).await?;
        let largest = |counts: [f32; 3]| counts.into_iter().fold(0.0, f32::max);
        if adapts && largest(counts) >= SATURATION {
            exposure = SHORT;
            counts = self.expose(&exposure).await?;
        } else if adapts && largest(counts) < 0.01 * SATURATION {
            exposure = LONG;
            counts = self.expose(&exposure).await?;
        }
        Ok(Counts {
            channels: counts.map(|count| count * exposure.1),
            is_saturated: largest(counts) >= SATURATION,
        })
    }
}
