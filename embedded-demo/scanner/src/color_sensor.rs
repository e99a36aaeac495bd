//! A color sensor TCS3472 on an I2C bus, with a lens that sees the measured spot only.

use embassy_time::{Duration, Timer};
use embedded_hal_async::i2c::I2c;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::ArmAngles;
use glimpse_core::gonio::{Calibration, Footprint, Reading, ReferenceCalibration};

use crate::machine::Sensor;

const ADDRESS: u8 = 0x29;
/// The bit that marks a byte as a register's number; later bytes continue with the next registers.
const REGISTER: u8 = 0xA0;
const ENABLE: u8 = 0x00;
const INTEGRATION_TIME: u8 = 0x01;
const GAIN: u8 = 0x0F;
const RED: u8 = 0x16;
const POWER_ON: u8 = 1;
const CONVERT: u8 = 2;
/// 64 cycles of 2.4 ms, the shortest time with counts up to 65,535.
const CYCLES: u8 = 64;
/// Longer than two integrations: the first begins before the arms rest.
const SETTLE: Duration = Duration::from_millis(320);

/// A TCS3472: linear red, green and blue.
#[derive(Debug)]
pub struct ColorSensor<B> {
    bus: B,
    calibration: ReferenceCalibration,
}

impl<B: I2c> ColorSensor<B> {
    /// Switches the sensor on, with the gain 4. `calibration` has its [`counts`](Self::counts) in the dark, and on a white
    /// tile with the arms at `white_at`; they are saturated at 65,535.
    ///
    /// # Errors
    /// [`ErrorCode::Sensor`] if it does not answer, or the calibration is invalid.
    pub async fn new(
        bus: B,
        calibration: Calibration,
        white_at: &ArmAngles,
        footprint: Footprint,
    ) -> Result<Self, Error> {
        let calibration = calibration
            .saturating_at(65_535.0)?
            .read_once_at(&white_at.directions(), footprint)?;
        let mut sensor = Self { bus, calibration };
        let settings = [
            (INTEGRATION_TIME, CYCLES.wrapping_neg()),
            (GAIN, 1),
            (ENABLE, POWER_ON),
        ];
        for (register, value) in settings {
            sensor.write(register, value).await?;
        }
        Timer::after_millis(3).await; // its oscillator
        sensor.write(ENABLE, POWER_ON | CONVERT).await?;
        Ok(sensor)
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), Error> {
        let written = self.bus.write(ADDRESS, &[REGISTER | register, value]).await;
        written.map_err(|_| FAULT)
    }

    /// Reads the counts of red, green and blue.
    ///
    /// # Errors
    /// [`ErrorCode::Sensor`] if the sensor does not answer.
    pub async fn counts(&mut self) -> Result<[f32; 3], Error> {
        Timer::after(SETTLE).await;
        let mut bytes = [0; 6];
        let read = self.bus.write_read(ADDRESS, &[REGISTER | RED], &mut bytes);
        read.await.map_err(|_| FAULT)?;
        let [r0, r1, g0, g1, b0, b1] = bytes;
        Ok([[r0, r1], [g0, g1], [b0, b1]].map(|bytes| u16::from_le_bytes(bytes).into()))
    }
}

const FAULT: Error = Error::new(ErrorCode::Sensor);

impl<B: I2c> Sensor for ColorSensor<B> {
    async fn read(&mut self, arms: &ArmAngles) -> Result<Reading, Error> {
        let counts = self.counts().await?;
        self.calibration.reading(counts, &arms.directions())
    }
}
